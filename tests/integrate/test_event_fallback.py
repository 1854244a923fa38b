"""Collocation over events: beside Runge and Kutta at finer steps, to the bit, and how often."""

from collections.abc import Callable

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.errors import SceneError
from ab_sim.scene import load_scene
from tests.deck.scenes import odd
from tests.effects.parts import Changes, scene_of
from tests.hard_cases.extremes import RUBBING
from tests.hard_cases.extremes import scene_of as extreme
from tests.integrate.test_dips import DIPS

STICK_SLIP: Changes = {
    "effects": {
        "rolling_friction": {"arm": 3e-4},
        "gravity": {"tilt": 0.32},
        "viscous_drag": {"coefficient": 0.05},
    },
    "start": {"speed": 30.0, "ball_angles": [0.5, 2.5]},
    "profile": None,
}
"""Gravity pulls each ball loose once a revolution, friction holds it again."""

NAME = "collocation"

Maker = Callable[[str, float], Drive]


def solver(stepper: str, step: float) -> Changes:
    return {"solver": {"stepper": stepper, "step": step}}


def friction(stepper: str, step: float) -> Drive:
    """The thesis' hold, with friction that stops balls and lets them go."""
    hold = {"start_speed": 100.0, "duration": 0.5, "acceleration": 0.0}
    profile = {"kind": "start_up", "acceleration": 40.0, "target_speed": 200.0}
    changes: Changes = {
        "effects": {"rolling_friction": {"arm": 1e-5}},
        "start": {"speed": 60.0, "ball_angles": [0.0, 0.0]},
        "profile": {**profile, "variable_speed_period": hold},
    }
    return Drive(scene_of("friction", changes, solver(stepper, step)))


def stick_slip(stepper: str, step: float) -> Drive:
    return Drive(scene_of("friction", STICK_SLIP, solver(stepper, step)))


def dips(stepper: str, step: float) -> Drive:
    """See test_dips: what holds them gives way for 0.7 ms of each half turn."""
    return Drive(scene_of("friction", DIPS, solver(stepper, step)))


def packed(stepper: str, step: float) -> Drive:
    """A row of four around the unbalance, which breaks up, meets again, and rubs.

    With the effects of packed-balls, so that its kernel serves.
    """
    row = {"count": 4, "mass": 5e-4, "radius": 1e-3}
    effects = {**RUBBING, "gravity": None, "viscous_drag": {"coefficient": 0.5}}
    start = {"speed": 90.0}
    return Drive(extreme(balls=row, effects=effects, start=start, **solver(stepper, step)))


def motor(stepper: str, step: float) -> Drive:
    """Through resonance at the torque's limit."""
    own = ["effects.motor.torque_limit=1.5e-3", f"solver.stepper={stepper}", f"solver.step={step}"]
    return Drive(load_scene("weak-motor", own))


def deck(stepper: str, step: float) -> Drive:
    """In space, with all there is: its motor at the limit, its balls rubbing and meeting."""
    changes: Changes = {
        "effects": {
            "race_friction": {"coefficient": 0.02},
            "motor": {"torque_limit": 2e-3},
        },
        "profile": {"kind": "start_up", "acceleration": 300.0, "target_speed": 250.0},
    }
    return Drive(odd("all", changes, solver(stepper, step)))


CASES: list[tuple[Maker, float, float, float, float]] = [
    (friction, 1e-3, 2e-4, 4.0, 1e-9),
    (friction, 0.01, 2e-4, 4.0, 1e-9),
    (stick_slip, 1e-3, 2e-4, 3.0, 1e-8),
    (dips, 1e-3, 1e-4, 1.0, 1e-10),
    (packed, 1e-3, 1e-4, 1.0, 1e-8),
    (motor, 1e-3, 2e-4, 6.0, 1e-9),
    (deck, 1e-3, 1e-4, 0.5, 1e-8),
]
"""Step, that of Runge and Kutta beside it, time [s], and how far balls may be apart [rad]."""


@pytest.mark.parametrize(("make", "step", "fine", "time", "within"), CASES)
def test_events_are_those_of_fine_steps(
    make: Maker, step: float, fine: float, time: float, within: float
) -> None:
    """As many, and the motion is the same, so they come at the same times."""
    drive, other = make(NAME, step), make("rk8", fine)
    found, true = drive.advance(round(time / step)), other.advance(round(time / fine))
    assert drive.events == other.events > 1
    assert drive.steps_with_unresolved_events == 0
    every = round(step / fine)
    np.testing.assert_allclose(
        found.ball_angles, true.ball_angles[every - 1 :: every], rtol=0, atol=within
    )
    now, then = drive.snapshot(), other.snapshot()
    np.testing.assert_array_equal(now.discrete_state, then.discrete_state)


@pytest.mark.parametrize("make", [stick_slip, packed, deck])
def test_it_resumes_to_the_bit_amid_events(make: Maker) -> None:
    """However steps are grouped: in a span that is cut, in one that goes on, and handed over."""
    one, other = make(NAME, 1e-3), make(NAME, 1e-3)
    whole, parts, kept = one.advance(600), [], []
    for count in [1] * 60 + [7] * 20 + [0, 130, 3, 267]:
        kept.append(other.snapshot())
        other.observe_at(other.time + 3e-4)
        parts.append(other.advance(count).samples)
    assert one.events == other.events > 1
    assert whole.samples.tobytes() == np.concatenate(parts).tobytes()
    for snapshot in kept[::5]:
        again = make(NAME, 1e-3)
        again.restore(snapshot)
        rest = again.advance(600 - snapshot.steps).samples
        assert rest.tobytes() == whole.samples[snapshot.steps :].tobytes()


def test_a_step_too_long_for_the_other_stepper_is_refused() -> None:
    words = r"leaves steps with events to rk8, .* 1024 parts.* race's drag.* at most [\de.-]+ s$"
    for stepper in (NAME, "auto"):
        with pytest.raises(SceneError, match=words):
            Drive(load_scene("thesis-hold", [
                f"solver.stepper={stepper}", "effects.viscous_drag.coefficient=1e4",
            ]))  # fmt: skip
