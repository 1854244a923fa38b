"""A plant of a stranger's own: written here, without a change to the package.

It is the deck in the plane once more, on axes that do not turn: another state, other equations of
the deck, the same drive. Balls, friction, events, steppers and recording know nothing of it.
"""

from typing import Any, NamedTuple

import numpy as np

from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory
from ab_sim.drive.way import Way
from ab_sim.dynamics.assemble import place_on, start_modes, system_of
from ab_sim.dynamics.carriers.facts import carrier
from ab_sim.dynamics.layout import layout_of
from ab_sim.equations.motion import Deck
from ab_sim.dynamics.race.ball import moment_from_shaft, relative_load, spindle_lever
from ab_sim.dynamics.race.table import COS, LOAD, REACH, SIN
from ab_sim.dynamics.system import MASS, deck_force
from ab_sim.integrate.events import events_address
from ab_sim.integrate.fixed_step import Run, stepping
from ab_sim.integrate.kept import Kept
from ab_sim.integrate.workspace import aligned, workspace
from ab_sim.scene import load_scene
from ab_sim.spindle.stretches import Stretch


@carrier(
    STATES=4,
    UNKNOWNS=2,
    STATE_NAMES=("x", "y", "x rate", "y rate"),
    NEEDS_ANGLE=True,
    WAYS=2,
    CHANNELS=("x", "y", "vx", "vy", "ax", "ay"),
)
class OnFixedAxes(NamedTuple):
    """M [kg], and M0 e [kg m]."""

    total_mass: float
    unbalance: float

    def begin(self, plant: Any, spindle: Any, state: Any) -> Any:
        block, w = plant.room.block, spindle.speed
        deck = Deck(state[0], state[1], state[2], state[3])
        fx, fy = deck_force(plant.system.effects, deck)
        ux, uy = self.unbalance * spindle.cos, self.unbalance * spindle.sin
        block[0, 0] = block[1, 1] = self.total_mass
        block[0, 1] = block[2, 2] = block[2, 3] = 0.0
        block[0, 2], block[1, 2] = -uy, ux
        block[0, 3], block[1, 3] = fx + ux * w * w, fy + uy * w * w
        return 0.0

    def bear(self, plant: Any, spindle: Any, frame: Any, c: Any, s: Any, i: int, state: Any) -> Any:
        system, table, block = plant.system, plant.room.table, plant.room.block
        m, rate = system.balls[i, MASS], state[4 + system.balls.shape[0] + i]
        nx, ny = c * spindle.cos - s * spindle.sin, s * spindle.cos + c * spindle.sin
        load, along = relative_load(plant, spindle.speed, rate, i)
        lever, _ = moment_from_shaft(plant, i)
        table[i, COS], table[i, SIN], table[i, LOAD] = nx, ny, load
        reach = (m * ny, -m * nx, -spindle_lever(plant, i))
        press = (-m * nx, -m * ny, 0.0)
        for r in range(3):
            table[i, REACH + r], table[i, REACH + 3 + r] = reach[r], press[r]
        block[0, 2] -= lever * ny
        block[1, 2] += lever * nx
        block[0, 3] += load * nx
        block[1, 3] += load * ny
        return along

    def move(self, plant: Any, spindle: Any, frame: Any, state: Any, slope: Any) -> None:
        slope[0], slope[1] = state[2], state[3]
        slope[2], slope[3] = plant.room.acceleration[0], plant.room.acceleration[1]

    def show(
        self, plant: Any, spindle: Any, c: Any, s: Any, state: Any, acceleration: Any, shown: Any
    ) -> None:
        for j in range(4):
            shown[j] = state[j]
        shown[4], shown[5] = acceleration[0], acceleration[1]

    def kick(self, state: Any, jumps: Any, velocities: Any) -> None:
        velocities[2] += jumps[0]
        velocities[3] += jumps[1]

    def straighten(self, state: Any) -> bool:
        return False


def test_the_same_drive_on_axes_that_do_not_turn() -> None:
    scene = load_scene("five-balls-8000-rpm", ["duration=1"])
    expected = Drive(scene)
    steps = round(0.5 / scene.solver.step)
    run = expected.advance(steps)
    assert expected.events >= 3
    own = system_of(scene)
    planar = own.carrier
    system = own._replace(carrier=OnFixedAxes(planar.total_mass, planar.unbalance))
    layout, step = layout_of(system), scene.solver.step
    state = aligned((layout.size,))
    state[layout.angles] = run.ball_angles[0] * 0.0 + np.array(scene.start.ball_angles or 0.0)
    work = workspace(system, expected.stepper, np.full(layout.size, 1e150))
    piece = expected.profile.piece_at(0.0)
    assert piece.end > 0.5
    fixed = system, place_on(piece), expected.stepper.weights, step
    run_of = Run(*fixed, state, start_modes(scene, system), work, events_address())
    advance = stepping(Kept(run_of))
    leg, at = next(Way([Stretch(piece, 0, steps, 0.0, step)]).after(0))
    own = Trajectory(run.channels, np.empty(run.samples.shape))
    assert advance(leg.table, at, 0, steps, np.nan, own.samples) == steps
    assert work.counts[0] == expected.events
    # Truncation differs with the axes; rk8 leaves next to none of it.
    np.testing.assert_allclose(own.ball_angles, run.ball_angles, rtol=0, atol=1e-9)
    np.testing.assert_allclose(own.position, run.position, rtol=0, atol=1e-13)
    np.testing.assert_allclose(own.acceleration, run.acceleration, rtol=0, atol=1e-8)
