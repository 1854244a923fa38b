"""What the firmware prototype decides, against the drive itself, offline; C as Python."""

import ctypes
import dataclasses
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.scene import load_scene
from tests.examples.prototype import InC, compiled, start_up

SCENE = load_scene("balanced-start-up")
PERIOD = 0.004
StartUp, Settings = start_up.StartUp, start_up.Settings

Change = Callable[[float, Any], Any]
"""Of the time and the numbers of a sample, what arrives instead; None if nothing does."""


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    return compiled(tmp_path_factory.mktemp("prototype"))


class Bench:
    """Firmware on a drive, each tick with one sample of spindle and deck."""

    def __init__(self, firmware: list[Any], scene: Any = SCENE) -> None:
        self.firmware, self.drive = firmware, Drive(scene, commanded=True)
        self.commands: list[list[float]] = []

    def run(
        self,
        seconds: float,
        spindle: Change = lambda _, sample: sample,
        deck: Change = lambda _, sample: sample,
        time: Callable[[float], float] = lambda t: t,
        followed: bool = True,
    ) -> None:
        for _ in range(round(seconds / PERIOD)):
            now = self.drive.observe()
            turned = spindle(now.time, (now.psi, now.omega))
            read = next(iter(now.readings.values()), now.acceleration)
            shaken = deck(now.time, (float(read[0]), float(read[1])))
            for one in self.firmware:
                if turned:
                    one.spindle(time(now.time), *turned)
                if shaken:
                    one.vibration(time(now.time), *shaken)
            self.commands.append([one.tick(PERIOD) for one in self.firmware])
            if followed:
                self.drive.command(self.commands[-1][0])
            self.drive.advance(round(PERIOD / self.drive.step))

    def final_whirl(self) -> float:
        """Its mean over the last second from now, over the eccentricity."""
        whirl = []
        for _ in range(250):
            self.run(PERIOD)
            whirl.append(self.drive.observe().whirl)
        return float(np.mean(whirl)) / SCENE.rotor.eccentricity


@pytest.mark.parametrize("angles", [(0.0, 2.0), (0.31, -2.97)])
def test_the_hold_that_it_ends_by_itself_balances(angles: tuple[float, float]) -> None:
    said: list[str] = []
    start = SCENE.start.model_copy(update={"ball_angles": angles})
    bench = Bench([StartUp(Settings(), said.append)], SCENE.model_copy(update={"start": start}))
    bench.run(13.0)
    assert [line.partition(":")[0] for line in said[:4]] == [
        "run up",
        "hold",
        "to final",
        "at speed",
    ]
    assert bench.final_whirl() < 0.25
    assert said[4].startswith("balanced to ")
    # What it measures is the whirl that is left: it turns with the spindle.
    measured = 1e-6 * float(said[4].split()[-2]) / SCENE.rotor.eccentricity
    assert measured == pytest.approx(bench.final_whirl(), abs=0.1)


def test_a_drive_that_is_quiet_already_is_not_held_for_long(library: ctypes.CDLL) -> None:
    """Firmware that takes over a balanced drive: the vibration never was large there."""
    bench = Bench([StartUp(Settings(), print)])
    bench.run(9.0)
    said: list[str] = []
    said_in_c: list[str] = []
    bench.firmware = [StartUp(Settings(), said.append), InC(library, said_in_c.append)]
    bench.run(6.0)
    assert said[2].startswith("to final: ") and said[2].endswith(" m/s^2, quiet")
    assert said[3].startswith("at speed")
    assert said_in_c == said
    assert bench.final_whirl() < 0.25


def test_without_a_hold_it_is_not_balanced() -> None:
    bench = Bench([StartUp(Settings(longest_hold=1e-3), print)])
    bench.run(6.0)
    assert bench.final_whirl() > 0.5


def test_an_accelerometers_reading_will_do() -> None:
    """With noise, digits and axes of its own; and of a drive on edge, where gravity adds to it."""
    said: list[str] = []
    sensor = "sensors.pickup={noise_density: 0.01, resolution: 0.01, axis_angle: 1.0}"
    bench = Bench([StartUp(Settings(), said.append)], load_scene("balanced-start-up", [sensor]))
    bench.run(11.0, deck=lambda _, read: (read[0] + 9.81, read[1]))
    assert any("to final: after" in line and line.endswith("quiet") for line in said)
    assert bench.final_whirl() < 0.25


def test_the_settings_are_the_same_in_c(library: ctypes.CDLL) -> None:
    values = dataclasses.astuple(Settings())
    assert tuple((ctypes.c_double * len(values)).in_dll(library, "default_settings")) == values


def after(moment: float, then: Any) -> Change:
    return lambda time, sample: then if time > moment else sample


@pytest.mark.parametrize(
    ("conditions", "said"),
    [
        ({}, "hold: at 110 rad/s"),
        ({"deck": after(1.0, None)}, "run down: failure: no valid sample for 2 s"),
        ({"deck": after(1.0, (math.nan, 0.0))}, "run down: failure: no valid sample for 2 s"),
        ({"spindle": after(1.0, (math.inf, 0.0))}, "run down: failure: no valid sample for 2 s"),
        ({"deck": after(1.0, (90.0, 130.0))}, "run down: failure: vibration of 158 m/s^2"),
        (
            {"time": lambda t: t if t < 1.0 else t - 1.0},
            "run down: failure: the drive's time went back",
        ),
        (
            {"followed": False},
            "run down: failure: the spindle stays at 0 rad/s, commanded 110",
        ),
    ],
)
def test_failures_end_in_standstill_and_c_decides_the_same(
    library: ctypes.CDLL, conditions: dict[str, Any], said: str
) -> None:
    heard: list[str] = []
    heard_in_c: list[str] = []
    python = StartUp(Settings(), heard.append)
    bench = Bench([python, InC(library, heard_in_c.append)])
    if not conditions:
        bench.run(1.0)
        for one in bench.firmware:
            one.stop()
    while python.state != "off":
        assert len(bench.commands) * PERIOD < 15.0, heard
        bench.run(0.5, **conditions)
    assert python.failed == bool(conditions)
    assert any(line.startswith(said) for line in heard), heard
    assert python.state == "off" and heard[-1].startswith("off: ")
    assert heard_in_c == heard
    np.testing.assert_allclose(*np.transpose(bench.commands), rtol=0, atol=1e-9)
    assert bench.commands[-1][0] == 0.0


def test_a_restarted_firmware_takes_over_a_turning_spindle() -> None:
    start = SCENE.start.model_copy(update={"speed": 150.0})
    bench = Bench([StartUp(Settings(), print)], SCENE.model_copy(update={"start": start}))
    bench.run(0.1)
    assert bench.commands[0][0] == 150.0, "no jump"
    assert 110.0 < bench.commands[-1][0] < 150.0, "down to the hold"


def test_nothing_is_commanded_without_a_drive() -> None:
    said: list[str] = []
    firmware = StartUp(Settings(), said.append)
    firmware.spindle(0.0, 0.0, 0.0)
    assert firmware.tick(PERIOD) == 0.0 and firmware.state == "waiting", "not without vibration"
    firmware.stop()
    firmware.stop()
    assert said == ["off: never started"] and not firmware.failed


def test_it_imports_nothing_of_ab_sim() -> None:
    folder = Path(start_up.__file__).parent
    sources = [*folder.glob("*.py"), *folder.glob("c/*.[ch]")]
    assert len(sources) >= 5
    assert not [path for path in sources if "ab_msgs" in path.read_text()]
    assert not [path for path in sources if "import ab_sim" in path.read_text()]
    assert not [path for path in sources if "from ab_sim" in path.read_text()]
