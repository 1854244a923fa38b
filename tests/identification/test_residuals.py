"""Judging what a fit leaves."""

import math

import numpy as np

from ab_sim.identification.residuals import turning_z
from tests.identification import drives


def test_residuals_that_do_not_turn_at_all_have_a_finite_score() -> None:
    """They alternate from sample to sample: less of them turns with the spindle than of noise."""
    measured = drives.measured(drives.scene(), balls=False)
    alternating = np.zeros((len(measured.time), 2))
    alternating[::2] = 1.0
    assert -math.inf < turning_z(alternating - 0.5, measured) < -5.0
    noise = np.random.default_rng(0).standard_normal(alternating.shape)
    assert abs(turning_z(noise, measured)) < 4.0
