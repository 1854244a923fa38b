"""The series of a motion solves its equations: y' = f(t, y) but for its last term."""

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.engine.integrate.vector_field import VectorField
from ab_sim.engine.kernels.code import called, code_of
from ab_sim.engine.taylor.assemble import taylor_code
from ab_sim.engine.taylor.clock import BEGIN, CLOCK, END, LONGEST, UNTIL
from ab_sim.model.dynamics.assemble import active_segment
from ab_sim.model.dynamics.system import ActiveSegment
from ab_sim.model.spindle.schedule import Ramp
from tests.integrate.random_scenes import PLANTS, scene_at_random

ORDER = 6


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("plant", PLANTS)
def test_what_is_left_of_the_equations_has_the_order(plant: str, seed: int) -> None:
    """With all effects that have a series, and the energy balance, at any place of the motion."""
    drive = Drive(scene_at_random(plant, seed, stepper="rk8", step=1e-4), energy_balance=True)
    drive.advance(150)
    (segment,) = [s for s in drive.schedule.segments if s.start <= drive.time < s.end]
    time, field = drive.time - segment.start, drive.vector_field()
    coefficients = series_at(drive, active_segment(segment), time)
    lengths = np.array([4e-4, 2e-4, 1e-4]) * 100.0 / drive.scene.start.speed
    left = [residual(field, coefficients, time, h) for h in lengths]
    scale = np.abs(coefficients[:, 1]) + 1e-9
    orders = np.polyfit(np.log(lengths), np.log([np.abs(x / scale).max() for x in left]), 1)[0]
    assert orders == pytest.approx(ORDER, abs=0.5), left


def residual(field: VectorField, series: np.ndarray, time: float, h: float) -> np.ndarray:
    """What is left of y' - f(t, y) so long after the beginning."""
    powers = h ** np.arange(ORDER + 1)
    slope, out = series[:, 1:] @ (np.arange(1, ORDER + 1) * powers[:-1]), np.empty(len(series))
    field.fill(time + h, series @ powers, out)
    return slope - out


def series_at(drive: Drive, place: ActiveSegment, time: float) -> np.ndarray:
    """Coefficients of all states at the present, shape (states, ORDER + 1)."""
    code, state = code_of(drive.system, Ramp), drive.snapshot().state
    constants, own = code.constants(drive.system), taylor_code(code, ORDER, 1)
    code.put_place(constants, [*place.segment, *place[1:]])
    clock = np.zeros((len(CLOCK), 1))
    clock[BEGIN], clock[UNTIL], clock[LONGEST] = time, np.inf, np.inf
    flat = np.zeros(own.size)
    called(own.addresses["coefficients"], constants, np.zeros(code.branches()), clock, state, flat)
    assert clock[END, 0] > time
    deck, n, found = drive.layout.deck.stop, drive.scene.balls.count, []
    for width in (*[1] * deck, n, n, *[1] * (len(state) - deck - 2 * n)):
        part, flat = np.split(flat, [width * (ORDER + 1)])
        found += list(part.reshape(ORDER + 1, width).T)
    return np.array(found)
