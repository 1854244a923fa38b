"""A firmware's test without Python and ROS: its C against the drive in C."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.c_code.compiled import needs_compiler
from tests.examples.prototype import FOLDER

HERE = FOLDER.parent / "firmware_in_c"
pytestmark = needs_compiler


def make(build: Path, drive: Path, *more: str) -> "subprocess.CompletedProcess[str]":
    """What its README says, but for where things are built: of one of its tests, or a file."""
    places = f"BUILD={build}", f"DRIVE={drive}"
    return subprocess.run(["make", "-C", HERE, *places, *more], capture_output=True, text=True)


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """As the Makefile makes it."""
    folder = tmp_path_factory.mktemp("example") / "drive"
    made = make(folder.parent, folder, f"AB_SIM={sys.executable} -m ab_sim", f"{folder}/drive.c")
    assert made.returncode == 0, made.stdout + made.stderr
    return folder


def test_the_firmware_balances_each_drive(drive: Path, tmp_path: Path) -> None:
    strict = "CFLAGS=-O2 -Wall -Wextra -Wpedantic -Werror"
    made = make(tmp_path, drive, "TESTS=start_up", "AB_SIM=false", strict)
    assert made.returncode == 0, made.stdout + made.stderr
    trials = [line for line in made.stdout.splitlines() if line.startswith("passed: ")]
    assert len(trials) == 5


def test_the_adaptive_one_balances_most_drives(drive: Path, tmp_path: Path) -> None:
    made = make(tmp_path, drive, "TESTS=adaptive", "AB_SIM=false", "CFLAGS=-O2 -Wall -Werror")
    assert made.returncode == 0, made.stdout + made.stderr
    assert "of 100 drives balanced to 0.3 of their whirl" in made.stdout


def test_a_firmware_that_does_not_balance_is_noticed(drive: Path, tmp_path: Path) -> None:
    """One that stops below the critical speed, where the balls go to the unbalance."""
    source = (FOLDER / "c" / "start_up.c").read_text().replace(
        "final_speed = 200.0", "final_speed = 70.0"
    ).replace("hold_speed = 110.0", "hold_speed = 60.0")  # fmt: skip
    (tmp_path / "start_up.c").write_text(source)
    (tmp_path / "start_up.h").write_text((FOLDER / "c" / "start_up.h").read_text())
    made = make(tmp_path, drive, "TESTS=start_up", f"FIRMWARE={tmp_path}")
    assert made.returncode != 0 and "FAILED: " in made.stdout
