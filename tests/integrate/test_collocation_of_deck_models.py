"""Collocation of what its linear parts are not enough for: a deck in space, and a motor's spindle.

Beside Runge and Kutta at much finer steps, and to the bit however a run is cut up.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from ab_sim.collocation.coordinates import CoordinatesInSpace, DeckModes
from ab_sim.drive import Drive
from ab_sim.dynamics.assemble import own_motion, system_of
from ab_sim.dynamics.own_motion import FROM_MODES, STIFFNESSES, TO_MODES
from ab_sim.scene import Scene
from tests.conftest import merge
from tests.deck.scenes import ODD, Changes, odd
from tests.integrate.random_scenes import PLANTS, scene_at_random

SAFETY = 10.0
"""Errors of whole runs beside what each span may leave."""
IN_SPACE: Changes = {
    "effects": {
        "gravity": {"tilt": 0.7, "acceleration": 9.80665},
        "hardening_suspension": {"cubic_stiffness": 3e7},
        "race_runout": {"offset_1": 2e-4, "offset_2": -1e-4, "lobe": 3e-4, "lobe_angle": 0.3},
    },
    "profile": {"kind": "start_up", "acceleration": 300.0, "target_speed": 250.0},
}
"""Every smooth effect at work on ``ODD``, and a ramp through critical speeds."""
DRIVEN: Changes = {
    "effects": {
        "motor": {
            "rotor_inertia": 2.9e-5,
            "torque_limit": 1.0,
            "proportional_gain": 2e-3,
            "integral_gain": 0.02,
            "back_emf_slope": 1e-5,
        }
    },
    "start": {"speed": 60.0, "ball_angles": [2.0, -1.0]},
    "profile": {"kind": "start_up", "acceleration": 60.0, "target_speed": 150.0},
}
"""A motor that never comes to its limit."""


def solver(stepper: str, step: float, **parameters: float) -> Changes:
    own = {"parameters": parameters} if parameters else {}
    return {"solver": {"stepper": stepper, "step": step, **own}}


def in_space(*changes: Changes) -> Scene:
    return odd("smooth", IN_SPACE, *changes)


@pytest.fixture
def driven(scene: Any) -> Callable[..., Scene]:
    """The thesis' drive with a motor."""
    return lambda *changes: scene(**merge(DRIVEN, changes[0]))


@pytest.fixture(params=["deck in space", "motor"])
def kind(request: pytest.FixtureRequest, driven: Any) -> Callable[..., Scene]:
    """Makes a scene."""
    return in_space if request.param == "deck in space" else driven  # type: ignore[no-any-return]


@pytest.mark.parametrize("tolerance", [1e-7, 1e-11])
def test_errors_are_what_was_asked_for(kind: Callable[..., Scene], tolerance: float) -> None:
    """In balls, deck and spindle; and the energy balance closes."""
    runs, steps = [], {"rk8": 2e-4, "collocation": 4e-3}
    for name, step in steps.items():
        own = {"tolerance": tolerance} if name == "collocation" else {}
        drive = Drive(kind(solver(name, step, **own)), energy_balance=True)
        run, energy = drive.advance(round(0.8 / step)), drive.energy()
        gained = energy.motor_work - energy.dissipated
        assert abs(energy.stored - energy.at_start - gained) < 1e4 * tolerance * energy.motor_work
        every = round(4e-3 / step)
        runs.append(run.decimated(every))
    true, found = runs
    radius = drive.scene.race.radius
    most = SAFETY * tolerance
    assert np.abs(found.ball_angles - true.ball_angles).max() < most
    assert np.abs(found["angle"] - true["angle"]).max() < most
    for name in ("x", "y"):
        assert np.abs(found[name] - true[name]).max() < most * radius
    if "qx" in drive.channels:
        for name in ("qw", "qx", "qy", "qz"):
            assert np.abs(found[name] - true[name]).max() < most


@pytest.mark.parametrize(
    ("plant", "seed"),
    [
        *((PLANTS[0], seed) for seed in (0, 3, 7, 17)),
        *((PLANTS[1], seed) for seed in (3, 7, 12, 13)),
    ],
)
def test_scenes_at_random_are_as_exact_as_asked(plant: str, seed: int) -> None:
    """Where errors hardly grow by themselves: benchmarks/collocation_at_random.py has others."""
    angles = []
    for name, step, own in (("rk8", 2e-4, {}), ("collocation", 4e-3, {"tolerance": 1e-9})):
        solver = {"stepper": name, "step": step, "parameters": own}
        drive = Drive(scene_at_random(plant, seed, **solver), energy_balance=True)
        angles.append(drive.advance(round(0.6 / step)).decimated(round(4e-3 / step)).ball_angles)
    assert np.abs(angles[1] - angles[0]).max() < SAFETY * 1e-9


def test_to_the_bit_however_it_is_cut_up(kind: Callable[..., Scene]) -> None:
    """In groups, from snapshots, and with commands in the middle of spans."""
    one, other = (Drive(kind(solver("collocation", 1e-3)), energy_balance=True) for _ in range(2))
    whole, parts, kept = [one.advance(137).samples], [], []
    for count in (1, 0, 30, 3, 1, 102):
        kept.append(other.snapshot())
        other.observe_at(other.time + 0.3e-3)
        parts.append(other.advance(count).samples)
    for drive in (one, other):
        drive.command(90.0)
    whole.append(one.advance(100).samples)
    parts += [other.advance(count).samples for count in (1, 50, 49)]
    assert np.concatenate(whole).tobytes() == np.concatenate(parts).tobytes()
    again = Drive(kind(solver("collocation", 1e-3)), energy_balance=True)
    for snapshot in kept:
        again.restore(snapshot)
        rest = again.advance(137 - snapshot.steps).samples
        assert rest.tobytes() == whole[0][snapshot.steps :].tobytes()


def test_coordinates_of_a_deck_in_space_are_its_state() -> None:
    """There and back again, whatever its place and its turn."""
    own = own_motion(system_of(in_space()))
    from_modes, to_modes = (own[first : first + 7, :7].tolist() for first in (FROM_MODES, TO_MODES))
    discrete_state, coordinates = DeckModes(from_modes, to_modes), CoordinatesInSpace()
    random = np.random.default_rng(3)
    for _ in range(5):
        state = random.normal(size=13).tolist()
        x, v = coordinates.of_state(discrete_state, state)
        back = coordinates.state(discrete_state, (1.0, 0.0), x, v)
        np.testing.assert_allclose(back, state, rtol=0.0, atol=1e-12)


def test_own_motion_of_a_deck_in_space_is_that_of_its_modes() -> None:
    """Without gravity and gyroscopes: rigid mounts far out on both sides, alike in X and Y."""
    four = [
        {"position": [x, y, 0.0], "stiffness": 1000.0, "damping": 0.0}
        for x in (-0.05, 0.05)
        for y in (-0.05, 0.05)
    ]
    plain: Changes = {
        "deck": {"center": [0, 0, 0], "inertia": [1e-4, 1e-4, 2e-4]},
        "rotor": {"inertia": [5e-6, 5e-6, 1e-5], "height": 0.0, "eccentricity": 1e-9},
        "race": {"height": [0.0, 0.0]},
        "balls": {"mass": 1e-9},
        "mounts": four,
    }
    system = system_of(odd("smooth", plain))
    rates = np.sort(np.sqrt(own_motion(system)[STIFFNESSES, :6]))
    mass = ODD["rotor"]["mass"]
    tilting, turning = 4000.0 * 0.05**2 / 1.05e-4, 8000.0 * 0.05**2 / 2.1e-4
    expected = np.sort(np.sqrt([4000.0 / mass] * 3 + [tilting] * 2 + [turning]))
    np.testing.assert_allclose(rates, expected, rtol=1e-4)
