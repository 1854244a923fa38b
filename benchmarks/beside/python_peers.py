"""Integrators that call the right-hand side from Python, and MuJoCo, which has a separate model."""

from collections.abc import Iterator
from functools import partial
from typing import Any

from ab_sim.analysis.accuracy_cost.methods import (
    ByTolerance,
    LegSolver,
    MeasuredMethod,
    cvode_solvers,
    dop853,
    lsoda,
)
from ab_sim.analysis.accuracy_cost.mujoco_peer import MuJoCo
from beside.case import SAMPLING, Case
from beside.turns import AbsentError, Family, Maker, timed

CALLED = (
    "the package's own equations, as machine code that is called from Python: SciPy's `odeint` "
    "(LSODA) and `solve_ivp` (DOP853), CVODE through scikit-sundae. MuJoCo's RK4 on a model "
    "of its own of the drive"
)
TOLERANCES = tuple(10.0**-k for k in range(4, 13))
STEPS = (2.5e-3, 1e-3, 0.5e-3, 0.25e-3)
"""Steps of MuJoCo [s]."""
PYTHON = " from Python"
EXTRA = "pip install 'ab_sim[peers]'"


class Studied:
    """Method of the package's accuracy study."""

    ours, continuous, simulated = False, True, SAMPLING.end

    def __init__(self, case: Case, method: str, setting: str, of: MeasuredMethod) -> None:
        self.case, self.method, self.setting, self.of = case, method, setting, of

    @property
    def evaluations(self) -> float | None:
        """Return the number of evaluations in the last run."""
        return self.of.evaluations

    def once(self) -> tuple[float, Any]:
        """Run once."""
        self.of.prepare()
        return timed(self.of.run)

    def error(self, kept: Any) -> float:
        """Return the error of a run's samples."""
        return self.case.error(self.of.samples(kept))


def families(case: Case) -> list[Family]:
    """Return all methods."""
    scipy: dict[str, LegSolver] = {"LSODA": lsoda, "DOP853": dop853}
    found: list[Family] = [
        (name + PYTHON, partial(_by_tolerance, case, name + PYTHON, solver))
        for name, solver in scipy.items()
    ]
    for name in ("CVODE Adams", "CVODE BDF"):
        found.append((name + PYTHON, partial(_cvode, case, name)))
    return [*found, (MuJoCo.name, partial(_mujoco, case))]


def _cvode(case: Case, name: str) -> Iterator[tuple[str, Maker]]:
    try:
        solver = cvode_solvers()[name]
    except ImportError:
        raise AbsentError(f"scikit-sundae is not installed; {EXTRA}") from None
    return _by_tolerance(case, name + PYTHON, solver)


def _by_tolerance(case: Case, name: str, solver: LegSolver) -> Iterator[tuple[str, Maker]]:
    for rtol in TOLERANCES:
        setting = f"rtol {rtol:.0e}"
        yield (
            setting,
            lambda t=rtol, s=setting: Studied(
                case, name, s, ByTolerance(case.f, None, name, solver, t)
            ),
        )


def _mujoco(case: Case) -> Iterator[tuple[str, Maker]]:
    for step in STEPS:
        setting = f"{1e3 * step:g} ms"

        def make(step: float = step, setting: str = setting) -> Studied:
            try:
                return Studied(case, MuJoCo.name, setting, MuJoCo(case.scene, SAMPLING, step))
            except ImportError:
                raise AbsentError(f"MuJoCo is not installed; {EXTRA}") from None

        yield setting, make
