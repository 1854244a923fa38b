"""SUNDIALS CVODE through scikit-sundae, which comes with the extra ``peers``."""

from functools import partial
from typing import Any

import numpy as np

from ab_sim.analysis.accuracy_cost.methods import FailedError
from ab_sim.analysis.accuracy_cost.right_hand_side import SmoothInterval
from ab_sim.analysis.accuracy_cost.tolerance import IntervalOutcome, LegSolver

MOST_STEPS = 10**7


def cvode_solvers() -> dict[str, LegSolver]:
    """Return solvers with CVODE's Adams and BDF methods, by display name.

    Raises:
        ImportError: scikit-sundae is not installed.
    """
    from sksundae.cvode import CVODE

    return {
        "CVODE Adams": partial(_solve, CVODE, "Adams"),
        "CVODE BDF": partial(_solve, CVODE, "BDF"),
    }


def _solve(
    solver: Any,
    method: str,
    leg: SmoothInterval,
    state: np.ndarray,
    relative: float,
    absolute: np.ndarray,
) -> IntervalOutcome:
    cvode = solver(
        leg.fill,
        method=method,
        rtol=relative,
        atol=absolute,
        max_num_steps=MOST_STEPS,
    )
    try:
        done = cvode.solve(leg.grid, state)
    except RuntimeError as error:
        raise FailedError(f"gave up: {error}") from error
    if not done.success:
        raise FailedError(f"gave up: {done.message}")
    return IntervalOutcome(done.y, int(done.nfev))
