"""Everything offline runs without ROS, and without the modules and files of Linux."""

import subprocess
import sys
from pathlib import Path

from tests.waiting import PATIENCE

ROOT = Path(__file__).parents[2]

PROGRAM = """
import importlib, pkgutil, sys

HIDDEN = {"fcntl", "grp", "pwd", "rclpy", "termios"}


class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in HIDDEN:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


def no_facts_of_processes(event, given):
    if event == "open" and str(given[0]).startswith("/proc/"):
        frame = sys._getframe(1)
        while frame:
            if frame.f_globals.get("__name__", "").startswith(("psutil", "numpy", "pyarrow")):
                return  # these have other ways on other systems
            frame = frame.f_back
        raise FileNotFoundError(given[0])


for name in HIDDEN:
    sys.modules.pop(name, None)
sys.meta_path.insert(0, Hidden())
sys.addaudithook(no_facts_of_processes)

import ab_sim

names = [found.name for found in pkgutil.walk_packages(ab_sim.__path__, "ab_sim.")
         if not found.name.startswith(("ab_sim.nodes", "ab_sim.cli.live", "ab_sim.__main__"))]
needing = []
for name in names:
    try:
        importlib.import_module(name)
    except ModuleNotFoundError as error:
        needing.append(f"{name}: {error}")
assert len(names) > 300, len(names)
assert not needing, needing

scene = ab_sim.load_scene("thesis-hold", ["duration=0.2"])
print(ab_sim.simulate(scene).trajectory["time"][-1])
"""


def test_offline_modules_and_a_run_with_the_system_hidden(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        cwd=ROOT,
        env={"HOME": str(tmp_path), "PATH": "/usr/bin:/bin"},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) == 0.2
