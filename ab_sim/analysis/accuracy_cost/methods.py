"""Methods of the study: this package's steppers, and integrators of SciPy and SUNDIALS.

SUNDIALS CVODE comes through scikit-sundae, with the extra ``peers``.
"""

import math
import warnings
from collections.abc import Callable
from functools import partial
from typing import Any, Protocol

import numpy as np
from scipy.integrate import ODEintWarning, odeint, solve_ivp

from ab_sim.analysis.accuracy_cost.problem import (
    INSTANTS,
    RightHandSide,
    SampleTimes,
    SmoothInterval,
    energy_error,
)
from ab_sim.base.errors import AbSimError, DivergedError
from ab_sim.drive import Drive
from ab_sim.drive.accuracy.trials import Samples
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene.load import with_solver
from ab_sim.scene.model import Scene


class FailedError(AbSimError):
    """Failure of a method to finish the run; the message appears in the method's row."""


class MeasuredMethod(Protocol):
    """Method at one setting, on one scene."""

    name: str
    """Display name of the method."""
    peer: bool
    """True if the method is another package's."""
    step: float | None
    """Step [s]; None for methods that choose it."""
    tolerance: float | None
    """Relative tolerance; None for methods with a fixed step."""
    evaluations: int | None
    """Evaluations of the right-hand side in the last run; None if unknown."""

    def prepare(self) -> None:
        """Return to the start; this is not timed."""

    def run(self) -> Any:
        """Take all steps and keep samples; this is timed.

        Raises
        ------
        FailedError
            The method could not finish.
        """

    def samples(self, kept: Any) -> Samples:
        """Convert the result of ``run`` to deck positions and ball angles."""

    def energy_error(self) -> float | None:
        """Return the energy balance's error, from a separate run; None without a balance."""


class OwnStepper:
    """Run of a scene with a stepper of this package, at one length of step.

    Parameters
    ----------
    scene
        Scene to run.
    sampling
        Times at which runs are compared.
    stepper
        Name of the stepper.
    step
        Step [s], which divides the sample period.

    Raises
    ------
    SceneError
        The scene refuses the step, e.g. beyond the stability limit.
    """

    peer: bool = False
    tolerance: float | None = None
    evaluations: int | None = None

    def __init__(self, scene: Scene, sampling: SampleTimes, stepper: str, step: float) -> None:
        self.name, self.sampling = stepper, sampling
        self.step: float | None = step
        self.each = sampling.per_period(step)
        assert self.each, "the step divides the sample period"
        self.scene = with_solver(scene, stepper, step)
        self.drive = Drive(self.scene)

    @property
    def events(self) -> int:
        """Events located in the last run."""
        return self.drive.events

    def prepare(self) -> None:
        """Return to the start."""
        self.drive.reset()

    def run(self) -> Trajectory:
        """Take and record all steps, as in normal use; keep those at the reference's times."""
        # The longest spacing at which each reference time that is the end of a step is kept.
        every = self.each // math.gcd(self.each, self.sampling.parts)
        try:
            return self.drive.advance(self.sampling.number * self.each, every)
        except DivergedError as error:
            raise FailedError(f"diverged: {error}") from error

    def samples(self, kept: Trajectory) -> Samples:
        """Return deck position and ball angles."""
        return Samples.of(kept)

    def energy_error(self) -> float | None:
        """Return the energy balance's error, from a separate run, which is not timed."""
        drive = Drive(self.scene, energy_balance=True)
        every = -(-self.sampling.number // INSTANTS)
        energies = []
        try:
            for done in range(0, self.sampling.number, every):
                drive.advance(self.each * min(every, self.sampling.number - done))
                energies.append(drive.energy())
        except DivergedError:
            return None
        return energy_error(energies)


ABSOLUTE = 0.01
"""Absolute tolerance of a state, as a multiple of relative tolerance times magnitude."""


LegSolver = Callable[[SmoothInterval, np.ndarray, float, np.ndarray], tuple[np.ndarray, int]]
"""Function that integrates a leg from a state, with relative and absolute tolerances.

It returns the states on the leg's grid, shape (times, states), and the number of evaluations.
It raises FailedError if it cannot finish.
"""


class ByTolerance:
    """Integrator at one relative tolerance.

    Parameters
    ----------
    f
        Right-hand side of the scene.
    with_energy_balance
        Factory of the right-hand side with an energy balance, called only by ``energy_error``; None
        if the scene has no energy balance.
    name
        Name of the integrator.
    solver
        Function that integrates a leg.
    tolerance
        Relative tolerance.
    """

    peer: bool = True
    step: float | None = None

    def __init__(
        self,
        f: RightHandSide,
        with_energy_balance: Callable[[], RightHandSide] | None,
        name: str,
        solver: LegSolver,
        tolerance: float,
    ) -> None:
        self.f, self.with_energy_balance, self.name = f, with_energy_balance, name
        self.solver = solver
        self.tolerance: float | None = tolerance
        self.evaluations: int | None = None

    def prepare(self) -> None:
        """Do nothing: no state is kept between runs."""

    def run(self) -> np.ndarray:
        """Return the states at the sample times."""
        return self._run(self.f)

    def samples(self, kept: np.ndarray) -> Samples:
        """Convert the states to samples."""
        return self.f.samples(kept)

    def energy_error(self) -> float | None:
        """Return the energy balance's error, from a run that integrates its states too."""
        if self.with_energy_balance is None:
            return None
        f = self.with_energy_balance()
        before = self.evaluations
        try:
            return f.energy_error(self._run(f))
        except FailedError:
            return None
        finally:
            self.evaluations = before

    def _run(self, f: RightHandSide) -> np.ndarray:
        state, kept, evaluations, relative = f.start, [], 0, self.tolerance
        assert relative is not None
        absolute = relative * ABSOLUTE * f.scale
        for leg in f.legs:
            states, more = self.solver(leg, state, relative, absolute)
            if not np.isfinite(states).all():
                raise FailedError("diverged: states that are not finite")
            # Solvers may return a transposed array, but compiled code reads contiguous memory.
            state = np.ascontiguousarray(states[-1])
            kept.append(states[leg.keep])
            evaluations += more
        self.evaluations = evaluations
        return np.concatenate(kept)


_MOST_STEPS = 10**7
"""Largest number of steps that a solver may take in a leg."""
# SciPy's type hints cover neither compiled functions nor methods named at run time.
_SOLVE_IVP: Any = solve_ivp
_ODEINT: Any = odeint


def _solve_ivp(
    method: str, leg: SmoothInterval, state: np.ndarray, relative: float, absolute: np.ndarray
) -> tuple[np.ndarray, int]:
    """Integrate a leg by a method of SciPy's ``solve_ivp``; see ``LegSolver``."""
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
    return done.y.T, done.nfev


def lsoda(
    leg: SmoothInterval, state: np.ndarray, relative: float, absolute: np.ndarray
) -> tuple[np.ndarray, int]:
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
                mxstep=_MOST_STEPS,
                full_output=True,
            )
        except ODEintWarning as warning:
            raise FailedError(f"gave up: {warning}") from warning
    return states, int(done["nfe"][-1])


dop853: LegSolver = partial(_solve_ivp, "DOP853")
_radau: LegSolver = partial(_solve_ivp, "Radau")
SCIPY: dict[str, LegSolver] = {"DOP853": dop853, "LSODA": lsoda, "Radau": _radau}
"""Solvers of SciPy by display name."""


def cvode_solvers() -> dict[str, LegSolver]:
    """Return solvers with CVODE's Adams and BDF methods, by display name.

    Raises
    ------
    ImportError
        Scikit-sundae is not installed.
    """
    from sksundae.cvode import CVODE

    return {
        "CVODE Adams": partial(_solve_by_cvode, CVODE, "Adams"),
        "CVODE BDF": partial(_solve_by_cvode, CVODE, "BDF"),
    }


def _solve_by_cvode(
    solver: Any,
    method: str,
    leg: SmoothInterval,
    state: np.ndarray,
    relative: float,
    absolute: np.ndarray,
) -> tuple[np.ndarray, int]:
    """Integrate a leg by CVODE; ``solver`` is its class, the others are those of ``LegSolver``."""
    cvode = solver(
        leg.fill,
        method=method,
        rtol=relative,
        atol=absolute,
        max_num_steps=_MOST_STEPS,
    )
    try:
        done = cvode.solve(leg.grid, state)
    except RuntimeError as error:
        raise FailedError(f"gave up: {error}") from error
    if not done.success:
        raise FailedError(f"gave up: {done.message}")
    return done.y, int(done.nfev)
