"""A vector field moved to another speed is the one built for it, to the bit."""

import numpy as np

from ab_sim.analysis.equilibria.resting import constant, field_at, resting_system, state_of
from tests.analysis.equilibria.drives import drive


def test_a_moved_field_is_the_one_at_that_speed() -> None:
    system = resting_system(drive())
    state = state_of(system, 150.0, np.array([1e-4, 2e-4]), np.arange(len(system.balls)) * 1.0)
    first = field_at(system, 100.0)
    before = first.slope(0.0, state)
    moved, built = first.at(constant(150.0)), field_at(system, 150.0)
    np.testing.assert_array_equal(moved.slope(0.0, state), built.slope(0.0, state))
    np.testing.assert_array_equal(moved.jacobian(0.0, state), built.jacobian(0.0, state))
    np.testing.assert_array_equal(first.slope(0.0, state), before)
