"""Tests of a firmware's decisions against a simulated drive, in lock step over ROS.

To test your own firmware, replace ``StartUp`` and adapt ``run_period``, which hands over the
samples of a period and sends the command that the firmware returns.
"""

import math
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from bench import PERIOD, Bench, stamp_ns
from sensor_msgs.msg import JointState
from start_up import Settings, StartUp

SCENE = "balanced-start-up"
ECCENTRICITY = 1e-4
"""Eccentricity of the scene's rotor [m], to which whirl is compared."""
LONGEST_RUN = 20.0
"""Simulated time in which a start-up must end [s]."""


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    """Return a fresh drive in lock step."""
    bench = Bench(SCENE, tmp_path / "drive.log")
    yield bench
    bench.close()


def run_period(bench: Bench, firmware: StartUp) -> None:
    """Let the firmware decide, advance the drive, and hand over its samples."""
    bench.period(firmware.tick(PERIOD))
    for message in sorted([*bench.joints, *bench.vibrations], key=stamp_ns):
        time = 1e-9 * stamp_ns(message)
        if isinstance(message, JointState):
            firmware.spindle(time, message.position[0], message.velocity[0])
        else:
            firmware.vibration(time, message.accel.linear.x, message.accel.linear.y)


def run_until(bench: Bench, firmware: StartUp, condition: Callable[[], bool]) -> None:
    """Run until a condition is true, which must be within ``LONGEST_RUN``."""
    for _ in range(round(LONGEST_RUN / PERIOD)):
        if condition():
            return
        run_period(bench, firmware)
    pytest.fail(f"not within {LONGEST_RUN:g} s; the firmware's state is {firmware.state!r}")


def test_the_start_up_balances_the_drive(bench: Bench) -> None:
    """The whirl at the final speed is small, and nothing failed."""
    lines: list[str] = []
    firmware = StartUp(Settings(), lines.append)
    run_until(bench, firmware, lambda: "balanced to" in lines[-1] if lines else False)
    whirl = [math.hypot(message.point.x, message.point.y) for message in bench.whirls]
    assert max(whirl) < 0.3 * ECCENTRICITY
    assert not firmware.failed


def test_a_lost_sensor_stops_the_spindle(bench: Bench) -> None:
    """Without vibration the firmware runs the spindle down."""
    firmware = StartUp(Settings())
    run_until(bench, firmware, lambda: firmware.state == "hold")
    bench.inject("vibration drops")
    bench.silent = [bench.vibrations]
    run_until(bench, firmware, lambda: firmware.state == "off")
    assert firmware.failed
    assert bench.joints[-1].velocity[0] == pytest.approx(0.0, abs=1.0)


def test_a_repeated_run_has_the_same_bits(bench: Bench) -> None:
    """A reset drive and a fresh firmware repeat a run exactly."""
    runs = []
    for _ in range(2):
        firmware = StartUp(Settings())
        samples: list[tuple[float, ...]] = []
        for _ in range(200):
            run_period(bench, firmware)
            samples += [(*joints.position, *joints.velocity) for joints in bench.joints]
        runs.append(samples)
        bench.reset()
    assert len(runs[0]) == 1000
    assert runs[0] == runs[1]
