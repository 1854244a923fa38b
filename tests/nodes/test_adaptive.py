"""An adaptive start-up live, with real nodes: what it says, does, and does with bad sensors."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from ab_msgs_py import JointSample, Level, WhirlSample, topics
from ab_msgs_py.samples import text_of
from ab_sim.drive import Drive
from ab_sim.drive.controllers import AdaptiveController
from ab_sim.nodes.adaptive_execution import SPINDLE_SILENT
from ab_sim.scene import load_scene
from ab_sim.scene.load import changed_scene
from tests.domains import own_domain
from tests.nodes.fleet import Fleet
from tests.nodes.lock_step import PERIOD, LockStep

pytestmark = pytest.mark.ros
SCENE = "adaptive-start-up"
PERIODS = 300
ECCENTRICITY = load_scene(SCENE).rotor.eccentricity


def test_in_lock_step_it_is_the_offline_start_up(fleet: Fleet) -> None:
    live = LockStep(fleet, SCENE)
    live.done("profile_controller/start")
    live.step(commands=0)  # it commands nothing before it has heard a sample
    for _ in range(PERIODS - 1):
        live.step(commands=1)
    drive = Drive(load_scene(SCENE))
    offline, heard = drive.advance(PERIODS * PERIOD), live.samples()
    assert heard.channels == offline.channels
    np.testing.assert_array_equal(heard.samples[:, 0], np.arange(PERIODS * PERIOD + 1))
    np.testing.assert_array_equal(heard.samples[1:], offline.samples)
    assert offline["speed"].max() > 100.0
    assert isinstance(drive.controller, AdaptiveController)
    decided = [decision.text for decision in drive.controller.decisions]
    assert live.statuses[2:] == [f"running: {text}" for text in decided]
    estimates = drive.controller.start_up.estimates
    for key, value in (
        ("dwells", str(estimates.dwells)),
        ("critical speed [rad/s]", f"{estimates.critical_speed:.6g}"),
        ("net unbalance [m]", f"{abs(estimates.net_unbalance):.6g}"),
    ):
        fleet.until(
            lambda key=key, value=value: fleet.value("profile_controller", key) == value, key
        )


def test_told_of_a_probe_it_is_offline_s_too(fleet: Fleet, tmp_path: Path) -> None:
    """Of the second of two, whose samples have a topic of their own."""
    probes = {"other": {"seed": 1}, "probe": {"bandwidth": 400.0, "range": "3 mm"}}
    changes = {"probes": probes, "profile.sensor": "probe", "sensors": {}}
    scene = changed_scene(load_scene(SCENE), changes, "probes")
    file = tmp_path / "told.yaml"
    file.write_text(yaml.safe_dump(scene.as_mapping()))
    live = LockStep(fleet, file)
    live.done("profile_controller/start")
    live.step(commands=0)
    for _ in range(159):
        live.step(commands=1)
    offline, heard = Drive(scene).advance(160 * PERIOD), live.samples()
    np.testing.assert_array_equal(heard.samples[1:], offline.samples)
    assert np.ptp(offline["probe_1"]) > 1e-4 and offline["speed"].max() > 90.0


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fleet]:
    """A drive in real time, at fewer wake-ups than its sensor has samples, and a controller."""
    with own_domain() as domain:
        fleet = Fleet(domain, tmp_path_factory.mktemp("adaptive"))
        fleet.start("drive_sim", scene=SCENE)
        fleet.start("profile_controller", profile=SCENE, use_sim_time=True)
        for topic in (topics.JOINT_STATES, topics.WHIRL, topics.PROFILE_STATUS):
            fleet.listen(topic)
        fleet.until(lambda: fleet.health("profile_controller"), "the controller is there")
        yield fleet
        fleet.close()


def speed_of(fleet: Fleet) -> float:
    heard = fleet.heard["joint_states"]
    return JointSample.of(heard[-1]).spindle_speed if heard else 0.0


class Said:
    """What a controller has said since it was started."""

    def __init__(self, heard: list[Any], before: int) -> None:
        self._heard, self._before = heard, before

    @property
    def texts(self) -> list[str]:
        return [text_of(message) for message in self._heard[self._before :]]

    def any(self, begin: str) -> bool:
        return any(text.startswith(begin) for text in self.texts)


def begun(fleet: Fleet, fault: str) -> Said:
    """A start-up whose fault comes while it runs up or dwells; its statuses, as they come."""
    heard = fleet.heard["profile_controller/status"]
    assert fleet.call("drive_sim/clear_faults")[0]
    assert fleet.call("drive_sim/reset")[0]
    before = len(heard)
    fleet.until(lambda: fleet.call("profile_controller/start")[0], "it starts")
    said = Said(heard, before)
    fleet.until(lambda: said.any("running: run up: "), "it runs up")
    assert fleet.set("drive_sim", faults=[fault])[0]
    assert not said.any("abort"), "nothing is wrong yet"
    assert fleet.call("drive_sim/inject_faults")[0]
    return said


@pytest.mark.parametrize(
    ("fault", "why"),
    [
        ("pick_up drops", "no valid sample for too long: sensor or spindle angle dropped out"),
        ("spindle drops", f"no valid sample for too long: .*{SPINDLE_SILENT}"),
        ("pick_up drifts 1e4", "a reading beyond the limit"),
    ],
)
def test_a_sensor_that_fails_ends_in_a_ramp_down(session: Fleet, fault: str, why: str) -> None:
    said = begun(session, fault)
    session.until(lambda: said.any("aborted"), "it is aborted")
    assert any(re.match(f"aborting: {why}", text) for text in said.texts), said.texts
    assert session.call("drive_sim/clear_faults")[0]
    session.until(lambda: speed_of(session) == 0.0, "it stands still")
    session.until(
        lambda: (h := session.health("profile_controller")) and re.search(why, h.message),
        "its health",
    )
    assert session.health("profile_controller").level is Level.WARN


def test_a_sensor_that_saturates_ends_safely(session: Fleet) -> None:
    """Aborted, or at the final speed and better than without balls, whatever it has read."""
    said = begun(session, "pick_up saturates 2")
    session.until(lambda: said.any("aborted") or said.any("done"), "it is over")
    if said.any("done"):
        end = session.heard["whirl"][-1].header.stamp.sec + 5  # free whirl dies down
        session.until(lambda: session.heard["whirl"][-1].header.stamp.sec >= end, "it is calm")
        places = [WhirlSample.of(message).place for message in session.heard["whirl"][-50:]]
        assert max(np.hypot(x, y) for x, y, _ in places) < ECCENTRICITY, "W/e without balls: 1.33"
    assert session.call("drive_sim/clear_faults")[0]


def test_a_sensor_that_fails_after_the_end_is_noticed(session: Fleet) -> None:
    assert session.call("drive_sim/reset")[0]
    heard = session.heard["profile_controller/status"]
    said = Said(heard, len(heard))
    session.until(lambda: session.call("profile_controller/start")[0], "it starts")
    session.until(lambda: said.any("done"), "it is done")
    assert session.set("drive_sim", faults=["pick_up drops"])[0]
    assert session.call("drive_sim/inject_faults")[0]
    session.until(lambda: said.any("aborting: no valid sample"), "it notices")
    session.until(lambda: said.any("aborted"), "it stands still")
    assert session.call("drive_sim/clear_faults")[0]
