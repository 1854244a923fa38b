"""A firmware's test in lock step, run as a user runs it."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.examples.prototype import FOLDER

pytestmark = pytest.mark.ros
HERE = FOLDER.parent / "firmware_in_lock_step"


def run_tests(folder: Path, domain: int, *options: str) -> "subprocess.CompletedProcess[str]":
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", folder, *options],
        env=environment, capture_output=True, text=True,
    )  # fmt: skip


def test_the_firmware_passes(domain: int) -> None:
    pytest.importorskip("rclpy", reason="needs ROS 2")
    result = run_tests(HERE, domain)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "3 passed" in result.stdout


def test_a_firmware_that_does_not_balance_fails(domain: int, tmp_path: Path) -> None:
    """It stops below the critical speed, where the balls go to the unbalance."""
    pytest.importorskip("rclpy", reason="needs ROS 2")
    shutil.copytree(HERE, tmp_path / "tests")
    firmware = tmp_path / "firmware_prototype"
    firmware.mkdir()
    source = (FOLDER / "start_up.py").read_text()
    slow = source.replace("hold_speed: float = 110.0", "hold_speed: float = 60.0").replace(
        "final_speed: float = 200.0", "final_speed: float = 70.0"
    )
    assert slow != source
    (firmware / "start_up.py").write_text(slow)
    result = run_tests(tmp_path / "tests", domain, "-k", "balances")
    assert result.returncode == 1, result.stdout + result.stderr
    assert "assert max(whirl) < 0.3 * ECCENTRICITY" in result.stdout
