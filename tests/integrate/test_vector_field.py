"""f and its exact Jacobian, on their own: against central differences, and the kernel that runs."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.engine.integrate.vector_field import VectorField
from ab_sim.model.dynamics.assemble import start_discrete_state, system_of
from ab_sim.model.dynamics.system import (
    DIRECTION,
    DISCRETE_COLUMNS,
    HEIGHT,
    JOINED,
    LOADED,
    StateLayout,
    System,
    layout_of,
)
from ab_sim.model.equations.effects import BallSpin, RaceRunout, SpindleAcceleration, ViscousDrag
from ab_sim.model.equations.in_space import InSpace
from ab_sim.model.equations.mounts import DAMPING, MOUNT_WIDTH, PLACE, STIFFNESS
from ab_sim.model.spindle import ScheduledSegment
from ab_sim.model.spindle.schedule import RaisedCosine
from ab_sim.scene import Scene, check_scene
from tests.conftest import MOTOR, THESIS, SceneMaker, merge

SMOOTH: dict[str, Any] = {
    "suspension": None,
    "unequal_suspension": {
        "stiffness_1": 1000.0,
        "stiffness_2": 1400.0,
        "damping_1": 0.1,
        "damping_2": 0.2,
        "axis_angle": 0.4,
    },
    "hardening_suspension": {"cubic_stiffness": 1e8},
    "gravity": {"tilt": 1.2, "direction": 0.7},
    "race_runout": {"offset_1": 3e-4, "offset_2": -2e-4, "lobe": 1e-3, "lobe_angle": 0.3},
}
"""With what the thesis' scene has: every effect without events. The suspension has two forms."""
SWITCHED: dict[str, Any] = {
    "rolling_friction": {"arm": 2e-5},
    "race_friction": {"coefficient": 0.1},
    "ball_contact": {"restitution_coefficient": 0.5},
    "motor": MOTOR,
}
CURVE = ScheduledSegment(0.5, 1.5, 0.3, RaisedCosine(80.0, 40.0, 1.0))
NOW = 0.9
"""Along that curve [s]."""
STATES = 1000
STEP = 1e-3
"""Of differences, over the size of a state."""


class Case(NamedTuple):
    """A plant; the states of a run would have such sizes."""

    system: System
    discrete_state: list[np.ndarray]
    sizes: np.ndarray
    """Shape (states,)."""


def thesis(**effects: Any) -> Scene:
    return check_scene(
        merge(THESIS, {"effects": effects, "start": {"ball_angles": [0.3, -0.9]}}), "test"
    )


def sizes_of(layout: StateLayout, deck_model: list[float]) -> np.ndarray:
    sizes = np.ones(layout.size)
    sizes[layout.deck], sizes[layout.rates] = deck_model, 30.0
    if layout.spindle.start < layout.spindle.stop:
        sizes[layout.spindle] = 1.0, 100.0, 1.0
    return sizes


def planar() -> Case:
    """Every smooth effect, with an energy balance."""
    made = thesis(**SMOOTH)
    system = system_of(made, energy_balance=True)
    sizes = sizes_of(layout_of(system), [1e-3, 1e-3, 0.1, 0.1])
    return Case(system, [start_discrete_state(made, system)], sizes)


def planar_in_branches() -> Case:
    """Every effect; balls slide either way, stick, move in a row, and the motor at its limit."""
    made = thesis(**SMOOTH, **SWITCHED)
    system = system_of(made)
    sizes = sizes_of(layout_of(system), [1e-3, 1e-3, 0.1, 0.1])
    discrete_state = []
    for first, second, joined, motor in (
        (1, -1, 0, 0),
        (0, 1, 0, 1),
        (1, 1, 1, 0),
        (0, 0, 0, -1),
        (0, 0, 1, 0),
    ):
        branch = start_discrete_state(made, system)
        branch[:, DIRECTION] = first, second, motor
        branch[:2, LOADED] = 1
        branch[:2, JOINED] = joined, 0
        discrete_state.append(branch)
    discrete_state[0][0, LOADED] = 0
    return Case(system, discrete_state, sizes)


def deck() -> Case:
    """A deck that tilts, with every effect that it can have, no symmetry, and an energy balance."""
    mounts = np.zeros((4, MOUNT_WIDTH))
    random = np.random.default_rng(5)
    for k, (x, y) in enumerate(((0.05, 0.04), (-0.05, 0.04), (-0.05, -0.04), (0.05, -0.04))):
        mounts[k, PLACE : PLACE + 3] = x, y, -0.01 * k
        mounts[k, STIFFNESS : STIFFNESS + 3] = random.uniform(2000.0, 4000.0, 3)
        mounts[k, DAMPING : DAMPING + 3] = random.uniform(0.1, 1.0, 3)
        turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
        mounts[k, DAMPING + 3 :] = turn.T.ravel()
    deck_model = InSpace(
        total_mass=0.2,
        unbalance=2e-6,
        eccentricity=1e-4,
        rotor_first_z=1e-4,
        deck_first=(1e-5, -2e-5, -3e-4),
        deck_inertia=(2e-4, 3e-4, 4e-4, 1e-5, -2e-5, 3e-5),
        rotor_second=(1.2e-5, 1.1e-5, 2e-6, 1e-7, 3e-7, -2e-7),
        mounts=mounts,
        gravity=(1.0, 2.0, -9.0),
    )
    effects = (
        ViscousDrag(1e-3),
        SpindleAcceleration(),
        BallSpin(),
        RaceRunout(3e-4, -2e-4, 1e-3, 0.3),
    )
    balls = system_of(thesis()).balls
    balls[:, HEIGHT] = 0.004, -0.003
    system = System(deck_model, balls, np.zeros((0, 2)), effects, True)
    discrete_state = np.zeros((len(balls) + 1, DISCRETE_COLUMNS), np.int64)
    sizes = sizes_of(layout_of(system), [*[1e-3] * 3, 1.0, *[0.3] * 3, *[0.1] * 3, *[10.0] * 3])
    return Case(system, [discrete_state], sizes)


CASES: dict[str, Callable[[], Case]] = {
    "planar": planar,
    "planar, in branches": planar_in_branches,
    "deck": deck,
}


def states_of(case: Case) -> np.ndarray:
    """Random ones, shape (STATES, states)."""
    return case.sizes * np.random.default_rng(1).normal(size=(STATES, case.sizes.size))


def differences(field: VectorField, state: np.ndarray, sizes: np.ndarray) -> tuple[Any, Any]:
    """The Jacobian by central differences of the sixth order, and of the fourth."""
    sixth, fourth = np.empty((2, state.size, state.size))
    for j, size in enumerate(sizes):
        h = np.zeros(state.size)
        h[j] = STEP * size
        one, two, three = (
            (field.slope(NOW, state + c * h) - field.slope(NOW, state - c * h)) / (2 * c * h[j])
            for c in (1, 2, 3)
        )
        fourth[:, j] = (4 * one - two) / 3
        sixth[:, j] = (15 * one - 6 * two + three) / 10
    return sixth, fourth


@pytest.mark.parametrize("name", CASES)
def test_jacobian_is_that_of_central_differences(name: str) -> None:
    """To their error: less than they differ from those two orders lower, but for rounding.

    Of f that is some 2^-53 of its size, times fifteen for what cancels within f, over STEP.
    """
    case = CASES[name]()
    fields = [
        VectorField(case.system, CURVE, discrete_state) for discrete_state in case.discrete_state
    ]
    states = states_of(case)
    slopes = [fields[k % len(fields)].slope(NOW, state) for k, state in enumerate(states)]
    scale = np.abs(slopes).max(axis=0)[:, None] / case.sizes
    rounding = 15 * 2.0**-53 / STEP * scale
    for k, state in enumerate(states):
        field = fields[k % len(fields)]
        sixth, fourth = differences(field, state, case.sizes)
        error = np.abs(field.jacobian(NOW, state) - sixth)
        bound = np.abs(sixth - fourth) + rounding
        assert (error <= bound).all(), ((error / bound).max(), np.argwhere(error > bound))
        assert (bound <= 1e-5 * scale).all(), (bound / scale).max()


def test_derivative_by_time_is_that_of_central_differences() -> None:
    """Beside a drive that the profile shakes and gravity turns around."""
    case = planar()
    field = VectorField(case.system, CURVE, case.discrete_state[0])
    for state in states_of(case)[:100]:
        one, two, three = (
            (field.slope(NOW + c * STEP, state) - field.slope(NOW - c * STEP, state))
            / (2 * c * STEP)
            for c in (1, 2, 3)
        )
        sixth, fourth = (15 * one - 6 * two + three) / 10, (4 * one - two) / 3
        found, rounding = field.time_derivative(NOW, state), 10 * 2.0**-53 / STEP
        bound = np.abs(sixth - fourth) + rounding * np.abs(field.slope(NOW, state)).max()
        assert (np.abs(found - sixth) <= bound).all()
        assert np.abs(found).max() > 1e3 * bound.max()


def test_a_drive_s_own_is_what_runs_now(scene: SceneMaker, with_hold: Any) -> None:
    """In the hold, whose piece begins elsewhere in time: the deck accelerates as recorded."""
    drive = Drive(scene(profile=with_hold(start_time=0.21234, duration=0.2)))
    drive.advance(300)
    field, state = drive.vector_field(), drive.snapshot().state
    assert field.scheduled.start == pytest.approx(0.21234)
    time, now = drive.time, drive.observe()
    slope, recorded = field.slope(time, state), drive.present().acceleration[0]
    c, s, w = np.cos(now.psi), np.sin(now.psi), now.omega
    a1, a2 = slope[2] - w * state[3], slope[3] + w * state[2]
    np.testing.assert_allclose([c * a1 - s * a2, s * a1 + c * a2], recorded, rtol=1e-12, atol=1e-12)
    drive.command(0.0)
    drive.advance(100)
    assert field.slope(time, state).tobytes() == slope.tobytes(), "it does not move with the drive"


@pytest.mark.parametrize(
    ("state", "discrete_state", "message"),
    [
        (
            np.zeros(7),
            np.zeros((3, DISCRETE_COLUMNS)),
            r"^state: .* \(7,\); .* \(8,\)",
        ),
        (
            np.zeros(8),
            np.zeros((2, DISCRETE_COLUMNS)),
            r"discrete_state: .* \(2, 4\); .* \(3, 4\)",
        ),
    ],
)
def test_arrays_of_another_size_are_refused(
    state: np.ndarray, discrete_state: np.ndarray, message: str
) -> None:
    system = system_of(thesis())
    with pytest.raises(ValueError, match=message):
        VectorField(system, CURVE, discrete_state).jacobian(NOW, state)
