"""The exact deck against Kim and Chung's small-angle equations, corrected.

They leave out what is of second order in the deck's displacements. Unbalance, balls and drag go
along with these, so that the forces on the deck do, too: then the difference falls with the square
of the amplitude (tests/reference/small_angle.py, test_deck_linear.py).
"""

import numpy as np
import pytest

from ab_sim.drive import Drive
from tests.deck.coordinates import coordinates
from tests.deck.of_params import scene_of
from tests.reference import Plate, simulate_small_angle

TIMES = np.linspace(0.0, 0.2, 11)[1:]
PLACE = np.array([1e-4, -2e-4, 3e-4, 0.01, -8e-3, 5e-3])
RATES = np.array([0.02, -0.03, 0.05, 0.6, -0.4, 0.5])
SIZES = (0.2, 0.1, 0.05, 0.025, 0.0125)


@pytest.mark.parametrize("speed", [130.0, 335.0])
def test_difference_falls_with_the_square_of_the_amplitude(speed: float) -> None:
    """In every coordinate, over four octaves: below the critical speeds, and above them."""
    balls, turning = np.array([0.5, -0.35]), np.array([5.0, -3.0])
    gaps, moves = [], []
    for size in SIZES:
        plate = Plate(omega=speed)
        plate = plate.but(eps=size * plate.eps, m=size * plate.m, D=size * plate.D)
        places, rates = np.append(size * PLACE, balls), np.append(size * RATES, turning)
        want, _ = simulate_small_angle(plate, places, rates, TIMES)
        drive = Drive(scene_of(plate.exact(), places, rates, effects={}), energy_balance=True)
        run = drive.advance(round(TIMES[-1] / drive.step))
        found = coordinates(run).places[np.rint(TIMES / drive.step).astype(int) - 1]
        gaps.append(np.abs(found - want).max(axis=0))
        moves.append(np.ptp(want[:, :6], axis=0))
    assert np.all(np.array(moves[0]) > 10 * gaps[0][:6]), "the equations are nearly right"
    falls = np.array(gaps[:-1]) / gaps[1:]
    np.testing.assert_allclose(falls[-1], 4.0, rtol=0.05)
    np.testing.assert_allclose(falls, 4.0, rtol=0.3)
