"""Everything offline runs without ROS, and without the modules, functions and files of Linux."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

import pytest

from tests.waiting import PATIENCE

ROOT = Path(__file__).parents[2]
LIKE_WINDOWS = Path(__file__).with_name("like_windows")

IMPORTS = """
import importlib, pkgutil

import ab_sim

names = [found.name for found in pkgutil.walk_packages(ab_sim.__path__, "ab_sim.")
         if not found.name.startswith(("ab_sim.nodes", "ab_sim.cli.live", "ab_sim.__main__"))]
needing = []
for name in names:
    try:
        importlib.import_module(name)
    except (AttributeError, ImportError) as error:
        needing.append(f"{name}: {error}")
assert len(names) > 300, len(names)
assert not needing, needing
"""
HIDDEN = """
import fcntl, os  # as other packages see them
hidden = {"__name__": "ab_sim.any"}
exec("import os, signal, sys; seen = os.name, sys.platform, hasattr(os, 'fork')", hidden)
assert (os.name, hidden["seen"]) == ("posix", ("nt", "win32", False))
for line in ("import fcntl", "signal.pthread_sigmask", "open('/proc/self/stat')", "open(__file__)"):
    try:
        exec(line, hidden | {"__file__": __file__})
    except (AttributeError, EncodingWarning, ModuleNotFoundError, FileNotFoundError):
        continue
    raise AssertionError(f"not hidden: {line}")
"""
RECORDING = """
import ab_sim

stored = ab_sim.open_recording("run.rrd")
assert stored.complete
print(stored.trajectory()["time"][-1])
"""
SWEEP = """
from multiprocessing import active_children

import numpy as np

import ab_sim
from ab_sim.base import workers
from ab_sim.design import work

if __name__ == "__main__":
    work.ENOUGH = workers.TRIAL = workers.WORTH_IT = 0.0  # start processes at once
    processes = set()
    sweep = ab_sim.sweep(
        ab_sim.load_scene("thesis-hold", ["duration=0.05", "effects.rolling_friction="]),
        {"balls.mass": np.linspace(0.0005, 0.001, 120).tolist()},
        workers=2,
        progress=lambda *_: processes.update(one.pid for one in active_children()),
    )
    print(len(sweep.table), len(processes))
"""


def output_of(folder: Path, *arguments: object) -> str:
    """Run Python on Windows, or as there: names are missing, and text is not UTF-8 by default."""
    places = [ROOT] if sys.platform == "win32" else [LIKE_WINDOWS, ROOT]
    environment = os.environ | {
        "HOME": str(folder),
        "PYTHONIOENCODING": "cp1252",
        "PYTHONPATH": os.pathsep.join(map(str, places)),
        "PYTHONWARNDEFAULTENCODING": "1",
        "XDG_CACHE_HOME": str(folder / "cache"),
    }
    done = subprocess.run(
        [sys.executable, *map(str, arguments)],
        cwd=folder,
        env=environment,
        capture_output=True,
        timeout=PATIENCE,
    )
    assert done.returncode == 0, done.stderr.decode(errors="replace")
    return done.stdout.decode()


def program(folder: Path, text: str) -> Path:
    file = folder / "program.py"
    file.write_text(text, encoding="utf-8")
    return file


@pytest.mark.skipif(sys.platform == "win32", reason="is Windows")
def test_only_ab_sim_misses_what_windows_lacks(tmp_path: Path) -> None:
    output_of(tmp_path, program(tmp_path, HIDDEN))


def test_offline_modules_are_imported(tmp_path: Path) -> None:
    output_of(tmp_path, program(tmp_path, IMPORTS))


def test_commands_run_record_and_read(tmp_path: Path) -> None:
    command = ("-m", "ab_sim")
    assert "Usage" in output_of(tmp_path, *command, "--help")
    made = ("--plot", "run.png", "--rrd", "run.rrd", "--json", "run.json")
    text = output_of(tmp_path, *command, "run", "thesis-hold", "--set", "duration=0.2", *made)
    assert "│" in text, "output to a pipe is UTF-8"
    assert (tmp_path / "run.png").stat().st_size > 10_000
    assert float(output_of(tmp_path, program(tmp_path, RECORDING))) == 0.2
    output_of(tmp_path, *command, "export", "run.rrd", "--csv", "run.csv", "--mcap", "bag")
    assert "complete" in output_of(tmp_path, *command, "repair", "bag")
    output_of(tmp_path, *command, "report", "run.rrd", "--html", "run.html")
    smooth = ("--set", "effects.rolling_friction=")
    output_of(tmp_path, *command, "c", "thesis-hold", *smooth, "--fmu", "drive.fmu")
    names = ZipFile(tmp_path / "drive.fmu").namelist()
    if shutil.which("cc"):
        assert any(name.endswith("/drive.dll") for name in names), names


def test_a_sweep_runs_in_two_processes(tmp_path: Path) -> None:
    runs, processes = output_of(tmp_path, program(tmp_path, SWEEP)).split()
    assert (int(runs), int(processes)) == (120, 2)
