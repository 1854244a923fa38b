"""What a running `drive_sim` says of its error, over real DDS."""

import itertools
import math
import time
from typing import Any

import numpy as np
import pytest

from ab_msgs_py import Block, JointSample, topics
from ab_msgs_py.samples import description_of
from ab_sim.scene import check_scene
from tests.nodes.fleet import Fleet
from tests.nodes.slow_to_compile import COMPILES, MODULE

pytestmark = pytest.mark.ros

PASSAGE = 5.0
"""s, on the wall's clock, from below the resonance to above it, or back."""
ANGLE, WHIRL = "error estimate, ball angle [rad]", "error estimate, whirl [e]"
SHARE = "error checks' share of work"


def number(fleet: Fleet, key: str) -> float:
    return float(fleet.value("drive_sim", key) or "nan")


def messages(fleet: Fleet) -> list[str]:
    return [health.message for health in fleet.healths]


def test_estimate_and_its_cost_are_published(fleet: Fleet) -> None:
    fleet.start("drive_sim", scene="nsc-case-1", changes="['solver.stepper=rk4']")
    fleet.until(lambda: number(fleet, "steps checked") > 3000, "3000 steps are done again")
    # The window with the start's transient: 1.3e-7 rad and 1.4e-4 e are the run's largest errors.
    assert 3e-8 < number(fleet, "largest " + ANGLE) < 3e-7
    assert 3e-5 < number(fleet, "largest " + WHIRL) < 3e-4
    assert 0 <= number(fleet, ANGLE) <= number(fleet, "largest " + ANGLE)
    # A slice is done only if it is expected to stay within the bound; the clock may surprise it.
    assert 0 < number(fleet, SHARE) < 1.5 * 0.05
    health = fleet.health("drive_sim")
    assert health is not None and "asked" not in health.message, "nothing was asked for"
    fleet.healths.clear()
    assert fleet.call("drive_sim/reset")[0]
    fleet.until(lambda: time_went_back(fleet), "it begins again")
    assert fleet.stop("drive_sim") == 0


def time_went_back(fleet: Fleet) -> bool:
    times = [float(each.values["simulated time [s]"]) for each in fleet.healths_of("drive_sim")]
    return any(after < before for before, after in itertools.pairwise(times))


def test_turned_off_it_says_nothing(fleet: Fleet) -> None:
    fleet.start("drive_sim", scene="nsc-case-1", error_checks=0)
    fleet.until(lambda: number(fleet, "simulated time [s]") > 0.5, "it runs")
    health = fleet.health("drive_sim")
    assert health is not None
    assert not [key for key in health.values if "error" in key]


def test_warns_when_led_outside_of_what_was_measured(fleet: Fleet) -> None:
    """Asked for on the first second of a run-up, then commanded through the resonance.

    For so much that whatever is cheapest here errs more in the resonance.
    """
    blocks, joints = fleet.listen(topics.BLOCK), fleet.listen(topics.JOINT_STATES)
    changes = ["accuracy.whirl=1e-8", "duration=1", "spindle.max_acceleration=100"]
    fleet.start("drive_sim", scene="one-ball", changes=str(changes))
    described = fleet.listen(topics.DESCRIPTION)
    fleet.until(lambda: described and number(fleet, "simulated time [s]") > 0.5, "it runs")
    description = description_of(described[0])
    assert description["accuracy"]["requested"] == {"whirl": 1e-8}
    recorded = check_scene(description["scene"], "what a recorder keeps")
    assert recorded.accuracy is None and recorded.solver.step == description["step"]
    assert 4e-3 / recorded.solver.step == pytest.approx(round(4e-3 / recorded.solver.step))
    chosen = fleet.value("drive_sim", "stepper chosen")
    assert chosen.startswith(f"{description['stepper']} at ") and "requested 1e-08 e" in chosen
    assert not any("less accurate than requested" in text for text in messages(fleet))
    # Checks take a twentieth of the loop's time, so that one passage may go by without any.
    speeds, turned = itertools.cycle([200.0, 20.0]), [-math.inf]

    def warned() -> bool:
        if time.monotonic() - turned[0] > PASSAGE:
            fleet.command(next(speeds))
            turned[0] = time.monotonic()
        return any("less accurate than requested" in text for text in messages(fleet))

    fleet.until(warned, "a warning")
    (text, *_) = [text for text in messages(fleet) if "less accurate than requested" in text]
    assert "(requested 1e-08)" in text and "whirl" in text
    assert number(fleet, "largest " + WHIRL) > 1e-8
    assert max(JointSample.of(message).spindle_speed for message in joints) > 60.0
    assert fleet.stop("drive_sim") == 0
    assert samples_in_a_row(blocks)


def samples_in_a_row(blocks: list[Any]) -> bool:
    steps = np.concatenate([Block.of(message).samples for message in blocks])[:, 0]
    return bool(np.all(np.diff(steps) == 1))


def test_nothing_is_compiled_once_it_runs(fleet: Fleet) -> None:
    changes = "['sensors.accelerometer={}']"
    fleet.start("drive_sim", MODULE, "0", scene="weak-motor", changes=changes)
    fleet.until(lambda: number(fleet, "simulated time [s]") > 0.2, "it runs")
    fleet.command(120.0)
    fleet.until(lambda: number(fleet, "steps checked") > 300, "steps are done again")
    fleet.command(-50.0)
    for service, switch in (("pause", True), ("step", None), ("pause", False), ("reset", None)):
        assert fleet.call(f"drive_sim/{service}", switch)[0]
    fleet.healths.clear()
    fleet.until(lambda: number(fleet, "simulated time [s]") > 0.3, "it runs again")
    assert fleet.stop("drive_sim") == 0
    before, ready, after = fleet.log("drive_sim").partition("weak-motor: 2 balls")
    assert ready and COMPILES in before, "it does say so"
    assert COMPILES not in after
