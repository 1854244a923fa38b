"""A deck model of a stranger's own: written here, in one file, without a change to the package.

It is the deck in the plane once more, on axes that do not turn: another state, other equations of
the deck, the same drive. Balls, friction, events, steppers and recording know nothing of it.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.dynamics import assemble, planar_scene
from ab_sim.equations.arrowhead import Arrow
from ab_sim.equations.deck_model import deck_model
from ab_sim.equations.motion import DeckMotion, SpindleMotion
from ab_sim.equations.race import BallConstants, OnRace, drag_force, relative_load
from ab_sim.equations.sums import Number, over_balls, over_effects
from ab_sim.scene import load_scene
from ab_sim.scene.model import Scene


@deck_model(
    UNKNOWNS=2,
    STATE_NAMES=("x", "y", "x rate", "y rate"),
    NEEDS_ANGLE=True,
    AXES=2,
    CHANNELS=("x", "y", "vx", "vy", "ax", "ay"),
)
class OnFixedAxes(NamedTuple):
    """M [kg], M0 e [kg m], and e [m]; state: place and velocity on fixed axes."""

    total_mass: Number
    unbalance: Number
    eccentricity: Number

    def arrow(
        self,
        effects: Any,
        balls: BallConstants,
        on: OnRace,
        spindle: SpindleMotion,
        state: Sequence[Number],
    ) -> Arrow:
        n, m, w, M = balls.number, balls.mass, spindle.speed, self.total_mass
        nx, ny = on.c * spindle.cos - on.s * spindle.sin, on.s * spindle.cos + on.c * spindle.sin
        load, along = relative_load(effects, balls, on, w)
        fx, fy = over_effects(effects, "deck_force", (0.0, 0.0), DeckMotion(*state))
        ux, uy = self.unbalance * spindle.cos, self.unbalance * spindle.sin
        turning = -uy - over_balls(n, on.mh * ny), ux + over_balls(n, on.mh * nx)
        return Arrow(
            block=[[M, 0.0, turning[0]], [0.0, M, turning[1]], [0.0, 0.0, 0.0]],
            force=[
                fx + ux * w * w + over_balls(n, load * nx),
                fy + uy * w * w + over_balls(n, load * ny),
                0.0,
            ],
            coupling=[m * ny, -(m * nx), -on.lever],
            normal_coupling=[-(m * nx), -(m * ny), 0.0],
            load=load,
            path_force=along + drag_force(effects, balls, on),
        )

    def rates(
        self, effects: Any, spindle: SpindleMotion, state: Sequence[Number], x: Sequence[Number]
    ) -> list[Number]:
        return [state[2], state[3], x[0], x[1]]

    def channels(
        self, effects: Any, spindle: SpindleMotion, state: Sequence[Number], x: Sequence[Number]
    ) -> list[Number]:
        return [*state, x[0], x[1]]

    def jump(self, state: Sequence[Number], jumps: Sequence[Number]) -> list[Number]:
        return [0.0, 0.0, jumps[0], jumps[1]]

    def at_rest(self, states: np.ndarray) -> np.ndarray:
        return np.array([[*states[:2], 0.0, 0.0, 0.0, 0.0]])

    def energy(
        self, effects: Any, balls: BallConstants, state: np.ndarray, psi: float, speed: float
    ) -> float:
        return 0.0  # nobody asks for a balance here


def deck_model_of(scene: Scene, effects: tuple[object, ...]) -> OnFixedAxes:
    planar = planar_scene.deck_model_of(scene, effects)
    return OnFixedAxes(planar.total_mass, planar.unbalance, planar.eccentricity)


class Own:
    """What makes scenes of it: of the deck in the plane, but for the deck."""

    deck_model_of = staticmethod(deck_model_of)
    start_of = staticmethod(planar_scene.start_of)
    yields_of = staticmethod(planar_scene.yields_of)
    rates_of = staticmethod(lambda system, top_speed: {})


def test_the_same_drive_on_axes_that_do_not_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = load_scene("five-balls-8000-rpm", ["duration=1"])
    steps = round(0.5 / scene.solver.step)
    expected = Drive(scene)
    run = expected.advance(steps)
    assert expected.events >= 3
    monkeypatch.setattr(assemble, "planar_scene", Own)
    monkeypatch.setitem(assemble._SCENES, OnFixedAxes, Own)
    drive = Drive(scene)
    assert type(drive.system.deck_model) is OnFixedAxes
    own = drive.advance(steps)
    assert drive.events == expected.events
    # Truncation differs with the axes; rk8 leaves next to none of it.
    np.testing.assert_allclose(own.ball_angles, run.ball_angles, rtol=0, atol=1e-9)
    np.testing.assert_allclose(own.position, run.position, rtol=0, atol=1e-13)
    np.testing.assert_allclose(own.acceleration, run.acceleration, rtol=0, atol=1e-8)
