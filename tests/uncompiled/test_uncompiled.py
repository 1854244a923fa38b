"""Runs what is here without compiling anything."""

import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
OWN = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "-n", "0"]


@pytest.mark.parametrize("name", ["elimination", "laws", "impacts"])
def test_without_compiling(name: str) -> None:
    asked = [*OWN, "-p", "tests.uncompiled.plugin", str(HERE / f"{name}.py")]
    done = subprocess.run(asked, cwd=HERE.parents[1], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
