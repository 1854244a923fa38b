"""Plug-ins on the command line: an installed package, and `--load FILE`."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.tool import ab_sim, refused
from tests.plug_ins.conftest import FILE
from tests.waiting import PATIENCE

SHARED = Path(__file__).with_name("shared_at_once.py")
WIND = ("--set", "effects.wind.force=0.01", "--set", "duration=0.05")


def from_nothing(
    folder: Path, *arguments: str, path: str = "", program: Path | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a command from nothing, in a folder, with a PYTHONPATH and a cache there."""
    environment = {**os.environ, "PYTHONPATH": path, "XDG_CACHE_HOME": str(folder / "cache")}
    start = program or Path(sys.executable).with_name("ab-sim")
    return subprocess.run(
        [sys.executable, str(start), *arguments],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )


def ways(request: pytest.FixtureRequest, way: str) -> tuple[str, list[str]]:
    """Return PYTHONPATH and options of an installed or a loaded plug-in."""
    if way == "installed":
        return str(request.getfixturevalue("installed")), []
    return "", ["--load", str(FILE)]


@pytest.mark.parametrize("way", ["installed", "loaded"])
def test_effect_metric_and_stepper_are_known(
    way: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    path, options = ways(request, way)
    stepper = ("--set", "solver.stepper=heun_of_tests", "--set", "solver.step=1e-5")
    run = from_nothing(
        tmp_path, *options, "run", "thesis-hold", *WIND, *stepper, "--json", "-", path=path
    )
    assert run.returncode == 0, run.stderr
    report = json.loads(run.stdout)
    assert report["judged_by"] > 0
    assert "wind" in report["effects"] and report["stepper"].startswith("heun_of_tests")


def test_without_the_plug_in_its_effect_is_unknown() -> None:
    error = refused("run", "thesis-hold", *WIND)
    assert "effects.wind = {'force': 0.01}: no such effect" in error


@pytest.mark.parametrize("way", ["installed", "loaded"])
def test_workers_of_a_sweep_know_them(
    way: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    path, options = ways(request, way)
    done = from_nothing(
        tmp_path,
        *(*options, "sweep", "thesis-hold", "--over", "effects.wind.force=0..0.01:400"),
        *("--set", "duration=0.05", "--metrics", "judged_by", "--workers", "2", "--json", "-"),
        path=path,
        program=SHARED,
    )
    assert done.returncode == 0, done.stderr
    runs = json.loads(done.stdout)["runs"]
    assert len(runs["run"]) == 400
    assert len(set(runs["judged_by"])) >= 2, "all runs were judged by one process"


def test_its_keys_and_meaning_are_listed(tmp_path: Path) -> None:
    keys = ab_sim("--load", str(FILE), "keys", "effects.wind", cwd=tmp_path)
    assert "effects.wind.force" in keys.stdout, keys.stderr
    effect = ab_sim("--load", str(FILE), "effects", "wind", cwd=tmp_path)
    assert "Constant force on the deck" in effect.stdout, effect.stderr


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("wind.yaml", "", "wind.yaml: must be a Python file"),
        ("my-wind.py", "", "my-wind.py: must be a Python file"),
        ("json.py", "", "json.py: another module is called json; give the file another name"),
        ("wind.py", "1 / 0", "wind.py: cannot be loaded: ZeroDivisionError: division by zero"),
        ("wind.py", "import wind_x", "wind.py: cannot be loaded: ModuleNotFoundError: No module"),
    ],
)
def test_a_file_that_cannot_be_loaded(name: str, text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    done = ab_sim("--load", name, "scenes", cwd=tmp_path)
    assert done.returncode == 2 and not done.stdout
    assert done.stderr.startswith(f"ab-sim: --load {words}")


def test_a_package_that_cannot_be_loaded(installed: Path, tmp_path: Path) -> None:
    """Every use of a registry says so, and what does not need one works."""
    shutil.copytree(installed, tmp_path / "site")
    (tmp_path / "site/ab_sim_wind.py").write_text("import ab_sim\nab_sim.register_all()")
    done = from_nothing(tmp_path, "run", "thesis-hold", path=str(tmp_path / "site"))
    assert done.returncode == 2
    assert done.stderr.startswith(
        "ab-sim: plug-in wind (ab_sim_wind) of the installed package ab-sim-wind: cannot be "
        "loaded: AttributeError: module 'ab_sim' has no attribute 'register_all'"
    )
    assert done.stderr.endswith("; update or uninstall the package\n")
    assert from_nothing(tmp_path, "--version", path=str(tmp_path / "site")).returncode == 0


def test_a_scheduler_s_workers_do_not_have_the_file(tmp_path: Path) -> None:
    over = ("--over", "effects.wind.force=0..0.01:4", "--scheduler", "localhost:1")
    done = ab_sim("--load", str(FILE), "sweep", "thesis-hold", *over, cwd=tmp_path)
    assert done.returncode == 2
    assert "workers of a scheduler" in done.stderr


def test_a_scene_cannot_load_a_file(tmp_path: Path) -> None:
    shutil.copy(FILE, tmp_path)
    scene = (
        f"load: [{FILE.name}]\n{Path('config/scenes/thesis-hold.yaml').read_text(encoding='utf-8')}"
    )
    (tmp_path / "scene.yaml").write_text(scene)
    done = ab_sim("run", "scene.yaml", cwd=tmp_path)
    assert done.returncode == 2 and "load" in done.stderr
