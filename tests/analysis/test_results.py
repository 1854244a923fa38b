"""Results of long work come back from disk exactly, and only where they are what was asked for."""

import json
import logging
import math
import multiprocessing
import os
import tempfile
from pathlib import Path
from typing import Any

import pytest

from ab_sim.analysis import result_cache
from ab_sim.analysis.result_cache import ResultCache
from ab_sim.scene import Scene, load_scene

CALLS: list[Any] = []


def moments(scene: Scene, drags: list[float]) -> dict[str, Any]:
    """A long work's stand-in: counts how often it is done."""
    CALLS.append(drags)
    return {"moments": tuple(drag * scene.balls.total_mass / 3.0 for drag in drags), "none": None}


@pytest.fixture
def kept(tmp_path: Path) -> ResultCache:
    CALLS.clear()
    return ResultCache(moments, tmp_path)


def only_file(folder: Path) -> Path:
    (file,) = folder.iterdir()
    return file


def test_the_second_time_nothing_is_computed(kept: ResultCache, tmp_path: Path) -> None:
    scene = load_scene("nsc-case-1")
    first = kept.of(scene, drags=[0.1, 0.2])
    again = ResultCache(moments, tmp_path).of(load_scene("nsc-case-1"), drags=[0.1, 0.2])
    assert first == again and len(CALLS) == 1
    assert first["moments"] == [
        0.1 * scene.balls.total_mass / 3.0,
        0.2 * scene.balls.total_mass / 3.0,
    ]


@pytest.mark.parametrize("change", ["balls.mass=0.00028", "duration=21", "name=other"])
def test_another_scene_is_computed(kept: ResultCache, change: str) -> None:
    kept.of(load_scene("nsc-case-1"), drags=[0.1])
    kept.of(load_scene("nsc-case-1", [change]), drags=[0.1])
    assert len(CALLS) == 2


def test_other_numbers_version_and_sources_are_computed(
    kept: ResultCache, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = load_scene("nsc-case-1")
    kept.of(scene, drags=[0.1])
    kept.of(scene, drags=[math.nextafter(0.1, 1.0)])
    assert len(CALLS) == 2, "neighbouring doubles are two numbers"
    with monkeypatch.context() as changed:
        changed.setattr(result_cache, "__version__", "0.0.0")
        kept.of(scene, drags=[0.1])
    assert len(CALLS) == 3
    read = result_cache.sources

    def edited(modules: Any) -> Any:
        found = read(modules)
        name = "ab_sim.engine.events.rows"
        return {**found, name: found[name]._replace(digest="of other content")}

    with monkeypatch.context() as changed:
        changed.setattr(result_cache, "sources", edited)
        kept.of(scene, drags=[0.1])
    assert len(CALLS) == 4
    kept.of(scene, drags=[0.1])
    assert len(CALLS) == 4


@pytest.mark.parametrize(
    "spoil",
    [
        lambda text: "",
        lambda text: text[:-20],
        lambda text: text.replace("0.0000", "0.0001").replace("e-05", "e-06"),
        lambda text: json.dumps({"seal": "", "result": {}}),
        lambda text: "[" * 100_000,
        lambda text: json.dumps([1]),
    ],
    ids=["empty", "truncated", "altered", "forged", "deep", "other"],
)
def test_what_cannot_be_believed_is_computed_anew(
    kept: ResultCache, spoil: Any, tmp_path: Path
) -> None:
    scene = load_scene("nsc-case-1")
    right = kept.of(scene, drags=[0.1])
    sound = only_file(tmp_path).read_text()
    only_file(tmp_path).write_text(spoil(sound))
    assert only_file(tmp_path).read_text() != sound
    assert kept.of(scene, drags=[0.1]) == right and len(CALLS) == 2
    assert only_file(tmp_path).read_text() == sound


def test_another_file_in_its_place_is_not_believed(kept: ResultCache, tmp_path: Path) -> None:
    scene = load_scene("nsc-case-1")
    kept.of(scene, drags=[0.1])
    first = only_file(tmp_path)
    kept.of(scene, drags=[0.2])
    (second,) = set(tmp_path.iterdir()) - {first}
    second.write_bytes(first.read_bytes())
    assert kept.of(scene, drags=[0.2])["moments"][0] == 0.2 * scene.balls.total_mass / 3.0


def test_without_a_folder_it_goes_on_and_says_so_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    CALLS.clear()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    for base in (tmp_path, tmp_path / f"cache-{os.getuid()}"):
        (base / "ab_sim").mkdir(mode=0o700, parents=True)
        (base / "ab_sim" / "results").write_text("in the way")
    result_cache.results_folder.cache_clear()
    try:
        with caplog.at_level(logging.WARNING):
            for _ in range(2):
                assert ResultCache(moments).of(load_scene("nsc-case-1"), drags=[0.1])
    finally:
        result_cache.results_folder.cache_clear()
    assert len(CALLS) == 2
    (record,) = caplog.records
    assert "no folder is writable by you alone" in record.message


def test_no_number_is_kept_that_json_does_not_have(kept: ResultCache, tmp_path: Path) -> None:
    with pytest.raises(ValueError):
        kept.of(load_scene("nsc-case-1"), drags=[float("inf")])
    assert not list(tmp_path.iterdir())


def _work(folder: Path) -> Any:
    scene = load_scene("nsc-case-1")
    return [ResultCache(moments, folder).of(scene, drags=[float(k)]) for k in range(20)]


def test_two_processes_at_once(tmp_path: Path) -> None:
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        one, other = pool.map(_work, [tmp_path, tmp_path])
    assert one == other
    files = list(tmp_path.iterdir())
    assert len(files) == 20 and all(file.suffix == ".json" for file in files), "nothing unfinished"
