"""Snapshots in files: to the bit, and refused where they do not fit."""

import json
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest

from ab_sim.base.errors import InputError
from ab_sim.drive import Drive
from ab_sim.drive.snapshot_file import read_snapshot, write_snapshot
from ab_sim.scene import Scene

SENSORS = {"front": {"bandwidth": 200.0, "noise_density": 1e-3, "seed": 3}}


@pytest.fixture
def saved(scene: Any, tmp_path: Path) -> tuple[Scene, Drive, Path]:
    """A drive amid a ramp, and its file."""
    chosen = scene(sensors=SENSORS)
    drive = Drive(chosen, commanded=True)
    drive.command(90.0, 37.0)
    drive.advance(777)
    path = tmp_path / "kept.json"
    write_snapshot(path, chosen, drive.snapshot(), {"bus": [1, 2.5]})
    return chosen, drive, path


def test_another_drive_goes_on_to_the_bit(saved: tuple[Scene, Drive, Path]) -> None:
    chosen, drive, path = saved
    kept, extra = read_snapshot(path, chosen)
    assert extra == {"bus": [1, 2.5]}
    other = Drive(chosen, commanded=True)
    other.restore(kept)
    for each in (drive, other):
        each.command(90.0, 37.0)
    assert drive.advance(3000).samples.tobytes() == other.advance(3000).samples.tobytes()


def test_a_file_is_replaced_whole(saved: tuple[Scene, Drive, Path]) -> None:
    chosen, drive, path = saved
    drive.advance(10)
    write_snapshot(path, chosen, drive.snapshot(), {})
    assert read_snapshot(path, chosen)[0].steps == 787
    assert [file.name for file in path.parent.iterdir()] == ["kept.json"]


def test_what_goes_on_from_it_counts(saved: tuple[Scene, Drive, Path]) -> None:
    """Commands under way are kept with the drive: other sources would take them otherwise."""
    chosen, drive, path = saved
    with pytest.raises(InputError, match="not continue with"):
        read_snapshot(path, chosen, "ab_sim.nodes.command_path")
    write_snapshot(path, chosen, drive.snapshot(), {}, "ab_sim.nodes.command_path")
    assert read_snapshot(path, chosen, "ab_sim.nodes.command_path")[0].steps == 777


def test_another_scene_is_refused_by_name(saved: tuple[Scene, Drive, Path], scene: Any) -> None:
    other = scene(sensors=SENSORS, balls={"mass": 2e-3}, rotor={"eccentricity": 2e-4})
    with pytest.raises(InputError, match="differs in balls.mass, rotor.ecc"):
        read_snapshot(saved[2], other)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"version": 2}, "has format version 2, "),
        ({"ab_sim": "0.0.1"}, "is of ab_sim 0.0.1 with kernel"),
        ({"kernel": "abc"}, "with kernel abc, and this is"),
        ({"format": "picture"}, "no snapshot of ab_sim"),
        ({"run": "{}"}, "its digest does not"),
        ({"run": 3}, "its digest does not"),
        ({"scene": []}, "differs in everything"),
        ({"digest": 3}, "its digest does not"),
        (
            {"run": "{}", "digest": sha256(b"{}").hexdigest()},
            "drive: drive: is missing",
        ),
        (
            {"run": "[", "digest": sha256(b"[").hexdigest()},
            "a drive: Expecting value",
        ),
    ],
)
def test_what_does_not_fit_is_refused(
    saved: tuple[Scene, Drive, Path], change: dict[str, Any], words: str
) -> None:
    chosen, _, path = saved
    path.write_text(json.dumps({**json.loads(path.read_text()), **change}))
    with pytest.raises(InputError) as refused:
        read_snapshot(path, chosen)
    assert words in str(refused.value) and "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"steps": 10**400}, "steps = 1000"),
        ({"steps": 10**18}, "step = 0.001: "),
        ({"steps": "many"}, "steps = 'many': "),
        ({"state": [[1.0], []]}, "state = [[1.0], []]: "),
        ({"state": [float("nan")]}, "state: has a number"),
        ({"discrete_state": [10**30]}, "discrete_state = [1000"),
        ({"memory": [[10**9, 10**9], [0.0]]}, "memory = [[1000"),
        ({"segments": []}, "segments = []: "),
        (
            {"segments": [[0, 1, 0, "Ramp", [0, 0]], [0, 1, 0, "Ramp", [0, 0]]]},
            "segments = [[0, 1, 0,",
        ),
        ({"segments": [[0, 1, 0, "exit", []]]}, "segments = [[0, 1, 0, 'exit', []]]: is not in"),
        ({"command": "fast"}, "command = 'fast': "),
        ({"pickups": []}, "pickups = []: "),
    ],
)
def test_what_no_drive_keeps_is_refused(
    saved: tuple[Scene, Drive, Path], change: dict[str, Any], words: str
) -> None:
    chosen, _, path = saved
    content = json.loads(path.read_text())
    kept = json.loads(content["run"])
    run = json.dumps({**kept, "drive": kept["drive"] | change})
    path.write_text(json.dumps(content | {"run": run, "digest": sha256(run.encode()).hexdigest()}))
    with pytest.raises(InputError) as refused:
        read_snapshot(path, chosen)
    assert f"snapshot {path}: holds no state" in str(refused.value)
    assert words in str(refused.value) and "Error" not in str(refused.value)


def test_what_does_not_fit_the_drive_changes_nothing(saved: tuple[Scene, Drive, Path]) -> None:
    _, drive, _ = saved
    kept = drive.snapshot()
    before, front = drive.observe(), kept.pickups["front"]
    for other in (
        kept._replace(steps=3, discrete_state=kept.discrete_state[:1]),
        kept._replace(steps=3, pickups={"rear": front}),
        kept._replace(steps=3, pickups={"front": front._replace(force=front.force[:1])}),
    ):
        with pytest.raises(ValueError, match="a drive with other"):
            drive.restore(other)
        assert drive.observe().steps == before.steps


@pytest.mark.parametrize("content", ["", "[", "[" * 100_000, "[]", "null", "3", "\x00"])
def test_no_snapshot_at_all(saved: tuple[Scene, Drive, Path], content: str) -> None:
    chosen, _, path = saved
    path.write_text(content)
    with pytest.raises(InputError, match="not a snapshot|no snapshot"):
        read_snapshot(path, chosen)


@pytest.mark.parametrize(
    ("name", "words"), [("a.txt", "must end in .json"), ("no/a.json", "there is no folder")]
)
def test_unwritable(saved: tuple[Scene, Drive, Path], name: str, words: str) -> None:
    chosen, drive, path = saved
    with pytest.raises(InputError, match=words):
        write_snapshot(path.parent / name, chosen, drive.snapshot(), {})
    with pytest.raises(InputError, match="cannot be read"):
        read_snapshot(path.parent / name, chosen)


@pytest.mark.parametrize(
    "missing", ["format", "version", "ab_sim", "kernel", "scene", "digest", "run"]
)
def test_what_is_not_there_is_refused(saved: tuple[Scene, Drive, Path], missing: str) -> None:
    chosen, _, path = saved
    content = json.loads(path.read_text())
    del content[missing]
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match=f"snapshot {path}: "):
        read_snapshot(path, chosen)


def mutated(path: Path, change: Any) -> None:
    """Change the run in a file, with a digest that fits."""
    content = json.loads(path.read_text(encoding="utf-8"))
    run = json.loads(content["run"])
    change(run["drive"])
    content["run"] = json.dumps(run)
    content["digest"] = sha256(content["run"].encode()).hexdigest()
    path.write_text(json.dumps(content), encoding="utf-8")


@pytest.mark.parametrize(
    ("key", "at", "value", "words"),
    [
        *(("state", at, 9e15, "= 9000000000000000.0: must be ") for at in range(8)),
        ("steps", None, -1, "steps = -1.0: must be 0 to"),
        ("command", None, float("inf"), "command = inf: must be -"),
        ("command", None, float("nan"), "command = nan: must be -"),
        ("acceleration", None, float("nan"), "acceleration = nan: "),
        ("acceleration", None, -3.0, "acceleration = -3.0: must be 0 to"),
        ("discrete_state", 0, [0, 0, 0, 2**60], "discrete_state.0.3 ="),
        ("discrete_state", 0, [7, 0, 0, 0], "discrete_state.0.0 = 7.0: must be -2 to 2"),
        ("segments", 0, [0.0, float("inf"), 0.0, "Ramp", [float("nan"), 0.0]], "segments"),
        ("segments", 0, [float("-inf"), float("inf"), 0.0, "Ramp", [0.0, 0.0]], "segments"),
        ("step", None, float("nan"), "step = nan: "),
    ],
)
def test_numbers_beyond_all_bounds_are_refused(
    saved: tuple[Scene, Drive, Path], key: str, at: int | None, value: Any, words: str
) -> None:
    chosen, _, path = saved

    def change(drive: dict[str, Any]) -> None:
        if at is None:
            drive[key] = value
        elif key == "segments":
            drive[key] = [value]
        else:
            drive[key][at % len(drive[key])] = value

    mutated(path, change)
    with pytest.raises(InputError, match="holds no state") as refused:
        read_snapshot(path, chosen)
    assert words in str(refused.value) and "\n" not in str(refused.value)


@pytest.mark.parametrize("text", ['{"key": 1}', "[1, 2]", "text", '{"format": "ab_sim other"}'])
def test_no_other_file_is_overwritten(
    saved: tuple[Scene, Drive, Path], text: str, tmp_path: Path
) -> None:
    chosen, drive, _ = saved
    other = tmp_path / "settings.json"
    other.write_text(text)
    with pytest.raises(InputError, match=f"{other}: .*existing file"):
        write_snapshot(other, chosen, drive.snapshot(), {})
    assert other.read_text() == text


def test_no_link_is_followed(saved: tuple[Scene, Drive, Path], tmp_path: Path) -> None:
    chosen, drive, path = saved
    before, link = path.read_bytes(), tmp_path / "link.json"
    link.symlink_to(path)
    with pytest.raises(InputError, match="is a symbolic link"):
        write_snapshot(link, chosen, drive.snapshot(), {})
    assert path.read_bytes() == before and link.is_symlink()
