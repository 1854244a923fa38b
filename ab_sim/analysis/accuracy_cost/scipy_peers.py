"""Integrators of SciPy."""

import warnings
from functools import partial
from typing import Any

import numpy as np
from scipy.integrate import ODEintWarning, odeint, solve_ivp

from ab_sim.analysis.accuracy_cost.methods import FailedError
from ab_sim.analysis.accuracy_cost.right_hand_side import SmoothInterval
from ab_sim.analysis.accuracy_cost.tolerance import IntervalOutcome, LegSolver

MOST_STEPS = 10**7
# SciPy's type hints cover neither compiled functions nor methods named at run time.
_SOLVE_IVP: Any = solve_ivp
_ODEINT: Any = odeint


def _solve_ivp(
    method: str, leg: SmoothInterval, state: np.ndarray, relative: float, absolute: np.ndarray
) -> IntervalOutcome:
    grid = leg.grid
    done = _SOLVE_IVP(
        leg.f,
        (grid[0], grid[-1]),
        state,
        method=method,
        t_eval=grid,
        rtol=relative,
        atol=absolute,
    )
    if not done.success:
        raise FailedError(f"gave up: {done.message}")
    return IntervalOutcome(done.y.T, done.nfev)


def lsoda(
    leg: SmoothInterval, state: np.ndarray, relative: float, absolute: np.ndarray
) -> IntervalOutcome:
    """Integrate a leg by LSODA through ``odeint``.

    Its loop is compiled; that of solve_ivp is Python and 3 x slower. LSODA integrates past the
    leg's end and interpolates: f continues smoothly there.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error", ODEintWarning)
        try:
            states, done = _ODEINT(
                leg.f,
                state,
                leg.grid,
                tfirst=True,
                rtol=relative,
                atol=absolute,
                mxstep=MOST_STEPS,
                full_output=True,
            )
        except ODEintWarning as warning:
            raise FailedError(f"gave up: {warning}") from warning
    return IntervalOutcome(states, int(done["nfe"][-1]))


dop853: LegSolver = partial(_solve_ivp, "DOP853")
radau: LegSolver = partial(_solve_ivp, "Radau")
SCIPY: dict[str, LegSolver] = {"DOP853": dop853, "LSODA": lsoda, "Radau": radau}
