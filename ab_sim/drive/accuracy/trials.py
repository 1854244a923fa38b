"""Trial runs of a scene with different settings, within a budget of CPU time; their deviations."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ab_sim.base.errors import DivergedError, SceneError, exact
from ab_sim.base.presentation import Progress
from ab_sim.drive.trajectory import Trajectory
from ab_sim.engine.integrate.registry import Stepper
from ab_sim.scene.load import with_solver
from ab_sim.scene.model import Scene

MOST_SAMPLES = 200_000
"""Largest number of samples per run for a comparison; longer runs are decimated."""
ROUNDING = 8.0 * float(np.finfo(float).eps)
"""Least relative error of a number, due to rounding."""


class Samples(NamedTuple):
    """Samples of a run for comparison at equally spaced times, without the start."""

    position: np.ndarray
    """Displacement of the deck on inertial axes [m], shape (samples, 2), or (samples, 3) in
    space."""
    angles: np.ndarray
    """Angle theta of each ball, unwrapped [rad], shape (samples, balls)."""

    @classmethod
    def of(cls, trajectory: Trajectory) -> "Samples":
        """Return copies of compared samples of a trajectory, whose memory can then be released."""
        return cls(trajectory.position.copy(), trajectory.ball_angles.copy())

    def every(self, n: int) -> "Samples":
        """Return every ``n``-th sample, beginning with the ``n``-th."""
        return Samples(self.position[n - 1 :: n], self.angles[n - 1 :: n])


class Deviation(NamedTuple):
    """Largest differences between a run and its reference, over the run and at its end."""

    angle: float
    """Largest difference of a ball angle theta over the run [rad]; 0 without balls."""
    whirl: float
    """Largest length of the difference of displacements over the run, in ``deviation``'s unit."""
    angle_end: float
    """Difference of ball angles at the last sample [rad]."""
    whirl_end: float
    """Length of the difference of displacements at the last sample, in the unit of ``whirl``."""


def deviation(run: Samples, reference: Samples, unit: float) -> Deviation:
    """Compare two runs at their common times.

    Parameters
    ----------
    run, reference
        Samples of the same stretch of time, equally spaced up to its end. The number of samples of
        one is a multiple of that of the other.
    unit
        Length in which the whirl's error is given [m]: the eccentricity e, or the race's radius for
        a rotor without unbalance.

    Raises
    ------
    ValueError
        There are no samples, neither number of samples is a multiple of the other, or the numbers
        of balls differ.
    """
    fewest, most = sorted([len(run.position), len(reference.position)])
    if not fewest or most % fewest or run.angles.shape[1] != reference.angles.shape[1]:
        shapes = [part.shape for part in (*run, *reference)]
        raise ValueError(f"samples of shapes {shapes} cannot be compared")
    run, reference = (
        samples.every(len(samples.position) // fewest) for samples in (run, reference)
    )
    whirl = np.linalg.norm(run.position - reference.position, axis=1) / unit
    angle = np.abs(run.angles - reference.angles).max(axis=1, initial=0.0)
    return Deviation(float(angle.max()), float(whirl.max()), float(angle[-1]), float(whirl[-1]))


def rounding(run: Samples, unit: float) -> Deviation:
    """Return the error of a run by rounding alone; ``unit`` as for ``deviation``."""
    angle = ROUNDING * float(np.abs(run.angles).max(initial=0.0))
    whirl = ROUNDING * float(np.abs(run.position).max(initial=0.0)) / unit
    return Deviation(angle, whirl, angle, whirl)


_RUNGS = tuple(c * 10**d for d in range(4) for c in (1, 2, 4, 5))
"""Divisors of the longest step that give the steps of a search: 10, 5, 2.5, 2, 1 ms ..."""
LONGEST = 1.0
"""Longest step that is tried [s]."""
_MOST_SECONDS = 300.0
"""Budget of CPU time for measurements [s]."""
_ROUNDS, ENOUGH = 5, 1.0
"""Number of rounds in which finalists are timed, and CPU time after which rounds end early [s]."""
PROBE = 500
"""Approximate number of steps of the first run of each method, which may compile a kernel."""
_NO_PARAMETERS: Mapping[str, float] = MappingProxyType({})


class Timed(NamedTuple):
    """Samples of a finished run, and the CPU time of the run."""

    samples: Samples
    seconds: float
    """CPU time of the steps [s]."""


Run = Callable[[Scene, int, int], Timed]
"""Function of a scene, a number of steps and a stride: run and keep every stride-th sample."""


@dataclass
class Tried:
    """Stepper and step that have been tried, with the result of the run."""

    scene: Scene
    """Scene whose solver is the tried stepper and step."""
    stepper: Stepper
    rung: int
    """Divisor of the longest step that gives the run's step."""
    kept: int
    """Samples per longest step; a divisor of the rung."""
    samples: Samples
    seconds: float
    """Least CPU time of all runs with this stepper and step [s]."""

    @property
    def step(self) -> float:
        """Integration step of the run [s]."""
        return self.scene.solver.step

    @property
    def parameters(self) -> Mapping[str, float]:
        """Parameters of the stepper."""
        return self.scene.solver.parameters


class TooExpensiveError(SceneError):
    """Error: measurements would take too long."""


class Trials:
    """Trial runs of a scene.

    Parameters
    ----------
    scene
        Scene with profile and duration.
    run
        Function that runs it.
    longest
        Longest step of each method to try [s], by name.
    period
        Period [s] that all steps must divide; None for a power of ten.
    tell
        Called before each run.
    """

    def __init__(
        self,
        scene: Scene,
        run: Run,
        longest: Mapping[str, float],
        period: float | None,
        tell: Progress | None = None,
    ) -> None:
        self.scene, self._run, self._longest, self._tell = scene, run, longest, tell
        reach = min(max(longest.values()), LONGEST)
        base = period or 10.0 ** max(math.ceil(math.log10(reach) - 1e-9), -6)
        self._base = round(1e9 * base)
        """Longest step [ns]; all others divide it."""
        bases = max(1, math.ceil(scene.duration / (1e-9 * self._base) - 1e-9))
        self._stride = math.ceil(bases / MOST_SAMPLES)
        self._bases = self._stride * math.ceil(bases / self._stride)
        self._spent = 0.0
        self._per_step: dict[str, float] = {}
        """Least CPU time per step so far [s], by stepper."""
        self.tried: list[Tried] = []

    @property
    def length(self) -> float:
        """Duration of the runs [s]: the scene's, rounded up to a whole step."""
        return 1e-9 * self._base * self._bases

    def rungs(self, stepper: Stepper) -> list[int]:
        """Return divisors of the longest step that give stable steps, the longest step first.

        All steps have a whole number of nanoseconds.
        """
        longest = min(self._longest[stepper.name], LONGEST)
        return [
            rung
            for rung in _RUNGS
            if self._base % rung == 0 and 1e-9 * self._base / rung <= longest
        ]

    def expected(self, stepper: Stepper, rung: int, like: Stepper) -> float:
        """Return the expected CPU time of a run [s].

        Parameters
        ----------
        stepper
            Method of the run.
        rung
            Divisor of the longest step that gives the run's step.
        like
            Method that has been run; its time per evaluation counts if ``stepper`` has not.
        """
        per_step = self._per_step.get(stepper.name)
        if per_step is None:
            per_step = self._per_step[like.name] * stepper.evaluations / like.evaluations
        return per_step * self._bases * rung

    def run(
        self,
        stepper: Stepper,
        rung: int,
        parameters: Mapping[str, float] = _NO_PARAMETERS,
        last: bool = False,
    ) -> Tried | None:
        """Run a setting; return None if it diverges or the scene refuses it.

        Raises
        ------
        SceneError, DivergedError
            The ``last`` setting failed.
        TooExpensiveError
            The run would exceed the budget.
        """
        try:
            step = 1e-9 * (self._base // rung)
            scene = with_solver(self.scene, stepper.name, step, parameters)
            if stepper.name not in self._per_step:
                few = rung * max(1, min(self._bases, PROBE // rung))
                # Run twice, because the first run may compile kernels.
                for _ in range(2):
                    self._go(scene, few, 1)
            self._afford(stepper, rung)
            # As many samples per longest step as fit, so that two runs have many times in common.
            kept = max(
                k for k in _RUNGS if rung % k == 0 and (k == 1 or k * self._bases <= MOST_SAMPLES)
            )
            every = rung // kept * (self._stride if kept == 1 else 1)
            timed = self._go(scene, self._bases * rung, every)
        except (DivergedError, SceneError) as error:
            if last or isinstance(error, TooExpensiveError):
                raise
            return None
        tried = Tried(scene, stepper, rung, kept, timed.samples, timed.seconds)
        self.tried.append(tried)
        return tried

    def time_again(self, finalists: list[Tried]) -> None:
        """Time finalists in turns, so that other load of the machine affects all of them."""
        spent = 0.0
        for _ in range(_ROUNDS):
            for one in finalists:
                seconds = self._go(
                    one.scene, self._bases * one.rung, one.rung * self._stride
                ).seconds
                one.seconds = min(one.seconds, seconds)
                spent += seconds
            if spent > ENOUGH:
                return

    def _go(self, scene: Scene, steps: int, every: int) -> Timed:
        """Report a scene, run it, and add the run's CPU time to the time spent."""
        name = scene.solver.stepper
        if self._tell is not None:
            first = "" if name in self._per_step else ", compiled first if necessary"
            what = f"{name} at {exact(scene.solver.step)} s{first}; seconds of CPU time"
            self._tell(what, int(self._spent), int(_MOST_SECONDS))
        timed = self._run(scene, steps, every)
        self._spent += timed.seconds
        self._per_step[name] = min(self._per_step.get(name, math.inf), timed.seconds / steps)
        return timed

    def _afford(self, stepper: Stepper, rung: int) -> None:
        """Refuse a run that is expected to exceed the budget of CPU time."""
        if self._spent + self.expected(stepper, rung, stepper) > _MOST_SECONDS:
            raise TooExpensiveError(
                f"accuracy: the search for a solver would take more than {_MOST_SECONDS:g} s of "
                f"CPU time, because a run of duration = {self.scene.duration:g} s is expensive; "
                "search with a shorter duration, and give the stepper and step found there"
            )
