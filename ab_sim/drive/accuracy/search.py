"""Search for the cheapest stepper and step that deliver a requested accuracy.

The error of a method on a scene cannot be predicted: it depends on the passage through resonance,
on events and more. The scene's own run is therefore repeated with several settings in turn. Each
run takes some milliseconds for a start-up of seconds.

1. Reference. The explicit method of the highest order runs with decreasing steps until two
   successive runs differ by far less than the requested accuracy. The last run is the reference.
   Its difference from the run before bounds its own error, including rounding that events
   amplify. If shorter steps no longer reduce the difference, double precision is exhausted. The
   reference's steps are chosen so that each step of another run ends with one of them: just
   after a jump of the spindle's acceleration, errors peak for some milliseconds, which the
   longest steps skip. If drag alone makes the steps far shorter, the method that takes the drag
   implicitly replaces the explicit one.
2. Candidates. A method with a tolerance runs with the longest step of the first method, which
   only sets the density of samples, and with tolerances from the requested accuracy downwards.
   The other methods run with the steps that their order suggests, as long as they can be cheaper
   than the best so far.
3. Choice. For each method, the longest step whose error times ``SAFETY`` is within the requested
   accuracy is timed again, in turns. The cheapest is taken. Among prices that are equal within
   ``ALIKE``, the most accurate is taken. Errors are reproducible and clocks are not, so that the
   choice is reproducible except at the edge of ``ALIKE``. The choice is part of the results, and
   a recording contains it instead of the request.
"""

import math
import time
from collections.abc import Mapping
from typing import NamedTuple

from ab_sim.base.errors import SceneError, exact
from ab_sim.base.presentation import Progress
from ab_sim.drive import Drive
from ab_sim.drive.accuracy.trials import (
    Deviation,
    Run,
    Samples,
    Timed,
    Trials,
    Tried,
    deviation,
    rounding,
)
from ab_sim.engine.integrate.choose import (
    STIFF,
    USUAL,
    largest_step,
    step_limiting_rates,
    top_speed,
)
from ab_sim.engine.integrate.registry import Stepper, parameters_of, stepper_named, steppers
from ab_sim.model.dynamics.assemble import DRAG, linear_rates, system_of
from ab_sim.model.dynamics.system import has_events
from ab_sim.scene.model import Scene
from ab_sim.scene.sections import Accuracy

SAFETY = 4.0
"""Safety factor on the measured error before comparison with the requested one."""


class WorkPrecision(NamedTuple):
    """Chosen setting with its measured error and cost."""

    requested: Accuracy
    stepper: str
    step: float
    """Step [s]."""
    parameters: Mapping[str, float]
    """Parameters of the stepper."""
    measured: Deviation
    """Largest error over the run, without safety factor; includes the reference's own error."""
    reference: str
    """Reference of the measurement: one of the package's steppers, at a finer setting."""
    unit: str
    """Unit of the whirl's error: e, or the race radius R."""
    seconds: float
    """CPU time per simulated second, measured at the time of the choice."""

    @property
    def reason(self) -> str:
        """Text for users: measured error, requested accuracy and cost."""
        measured, requested = [], []
        for tolerance, error, unit in (
            (self.requested.angle, self.measured.angle, "rad"),
            (self.requested.whirl, self.measured.whirl, self.unit),
        ):
            if tolerance is not None:
                measured.append(f"{error:.1e} {unit}")
                requested.append(f"{tolerance:g} {unit}")
        return (
            f"{setting(self.stepper, self.step, self.parameters)}: "
            f"measured error {', '.join(measured)} "
            f"(requested {', '.join(requested)}, safety factor {SAFETY:g}) by ab_sim's own "
            f"{self.reference}, "
            f"{1e6 * self.seconds:.0f} us of CPU time per simulated second"
        )

    def report(self) -> dict[str, object]:
        """Return JSON-able values in SI units, the whirl in ``whirl_unit``."""
        return {
            "requested": self.requested.model_dump(exclude_none=True),
            "measured": {"angle": self.measured.angle, "whirl": self.measured.whirl},
            "measured_by": f"ab_sim's own {self.reference}",
            "whirl_unit": self.unit,
            "safety_factor": SAFETY,
            "cpu_seconds_per_simulated_second": self.seconds,
            "reason": self.reason,
        }


def setting(stepper: str, step: float, parameters: Mapping[str, float]) -> str:
    """Return a stepper with its step [s] and parameters as text."""
    parameters_text = "".join(f", {name} {value:g}" for name, value in parameters.items())
    return f"{stepper} at {1e3 * step:g} ms{parameters_text}"


def share_of(requested: Accuracy, angle: float, whirl: float) -> float:
    """Return the larger ratio of error to requested accuracy; at most 1 if both are met."""
    shares = [
        error / tolerance
        for error, tolerance in ((angle, requested.angle), (whirl, requested.whirl))
        if tolerance is not None
    ]
    return max(shares)


ALIKE = 1.15
"""Ratio of CPU times up to which two settings are equally cheap, as short runs scatter."""
_SHARPER = 10.0
"""Required ratio of the allowed error, with ``SAFETY``, to the difference of the references."""
_STALLED = 3
"""Number of successive refinements without halving of the difference that indicates rounding.

A refinement that increases the difference by ``_SHARPER`` shows instead that earlier runs agreed by
chance.
"""
_SHARED = 20
"""Number that divides the number of reference steps within one longest step.

Each longer step then ends at a sample of the reference, or each second or fifth one does.
"""
_DRAG_RULES = 1000.0
"""Ratio of the stable steps without and with drag above which no explicit method is tried."""
_TOLERANCES = 6
"""Largest number of tolerances tried per method."""
_FEWEST = 4
"""Least number of possible steps that a period must leave."""


def cheapest(
    scene: Scene,
    run: Run,
    period: float | None = None,
    commanded: bool = False,
    tell: Progress | None = None,
) -> tuple[Scene, WorkPrecision]:
    """Return the scene with the cheapest solver that delivers its requested accuracy.

    Parameters
    ----------
    scene
        Scene with a requested accuracy.
    run
        Function that runs a scene.
    period
        Period of a live node [s], which must be a multiple of the step; None for any step.
    commanded
        Whether the step must be stable up to ``spindle.max_speed``.
    tell
        Called before each run, see ``Trials``.

    Returns
    -------
    tuple[Scene, WorkPrecision]
        The scene with its solver, and the solver's measured error and cost.

    Raises
    ------
    SceneError
        The accuracy cannot be reached, or not be measured in reasonable time; the message states
        what is possible.
    DivergedError
        The scene's run diverges with every step.
    """
    return _Search(scene, run, period, commanded, tell).choose()


class _Search:
    """Search for the cheapest solver of one scene; the arguments are those of ``cheapest``."""

    def __init__(
        self,
        scene: Scene,
        run: Run,
        period: float | None,
        commanded: bool,
        tell: Progress | None,
    ) -> None:
        assert scene.accuracy is not None
        self.scene, self.requested = scene, scene.accuracy
        system = system_of(scene)
        rates = linear_rates(system, top_speed(scene, commanded))
        other_rates = {what: rate for what, rate in rates.items() if what != DRAG}
        eventful = has_events(system.effects)
        priced = [s for s in steppers().values() if s.priced and (s.locates_events or not eventful)]
        self._tolerant = [s for s in priced if s.keeps_tolerance]
        by_step = [s for s in priced if not s.keeps_tolerance]
        longest = {s.name: largest_step(s, step_limiting_rates(s, rates))[0] for s in by_step}
        self._usual, other = stepper_named(USUAL), stepper_named(STIFF)
        without_drag = largest_step(self._usual, other_rates)[0]
        stiff = without_drag >= _DRAG_RULES * longest[USUAL]
        self._first = other if stiff else self._usual
        # Methods with a tolerance get samples as dense as the first method's steps.
        longest |= {stepper.name: longest[self._first.name] for stepper in self._tolerant}
        self._others = [] if stiff else [s for s in by_step if s is not self._usual]
        self._trials = Trials(scene, run, longest, period, tell)
        if period is not None and len(self._trials.rungs(self._first)) < _FEWEST:
            raise SceneError(
                f"accuracy: too few step lengths are stable, whole nanoseconds, and a whole "
                f"fraction of the period of {period:g} s ({1 / period:g} 1/s); use a rate of 50, "
                "100, 125, 200, 250, 500 or 1000 1/s, or give a solver"
            )

    def choose(self) -> tuple[Scene, WorkPrecision]:
        """Return the scene with the cheapest accurate solver, and measurements that justify it."""
        self._find_reference()
        settings = [self._longest_passing(self._first)]
        for stepper in self._tolerant:
            settings += self._within_tolerance(stepper)
        for stepper in sorted(self._others, key=lambda stepper: -stepper.order):
            settings += self._cheaper(stepper, min(one.seconds for one in settings))
        self._trials.time_again(settings)
        least = min(one.seconds for one in settings)
        alike = [one for one in settings if one.seconds <= ALIKE * least]
        taken = min(alike, key=lambda one: self._share(self._error(one)))
        return taken.scene, WorkPrecision(
            self.requested,
            taken.stepper.name,
            taken.step,
            taken.parameters,
            self._error(taken),
            _setting_of(self._reference),
            self.scene.whirl_unit[1],
            taken.seconds / self._trials.length,
        )

    def _error(self, tried: Tried) -> Deviation:
        """Return the error bound of a run: distance from the reference plus its error."""
        if tried is self._reference:
            return self._doubt
        difference = self._between(tried, self._reference)
        return Deviation(*(a + b for a, b in zip(difference, self._doubt, strict=True)))

    def _find_reference(self) -> None:
        """Refine the first method's setting until changes are negligible."""
        differences: list[Deviation] = []
        least, stalled, enough = math.inf, 0, False
        previous: Tried | None = None
        rungs = self._trials.rungs(self._first)
        for place, rung in enumerate(rungs, start=1):
            # Once the differences are small enough, only a rung that can be the reference is run.
            # Two runs may agree by chance, so a much larger difference afterwards starts again.
            serves, last = rung % _SHARED == 0, place == len(rungs)
            if enough and not (serves or last):
                continue
            tried = self._trials.run(self._first, rung, last=last)
            if tried is None:
                continue
            if previous is not None:
                differences.append(self._between(previous, tried))
                share = self._share(differences[-1])
                if share > _SHARPER * least:
                    least, stalled = share, 0
                else:
                    stalled = 0 if share < 0.5 * least else stalled + 1
                    least = min(least, share)
                enough = _SHARPER * SAFETY * share <= 1.0 or stalled >= _STALLED
            previous = tried
            if enough and serves:
                break
        assert previous is not None, "the last one of all would have raised"
        self._reference, self._stalled = previous, stalled >= _STALLED
        newest = differences[-max(stalled, 1) :]
        endless = [Deviation(*(math.inf,) * 4)]
        rounding_error = rounding(previous.samples, self.scene.whirl_unit[0])
        doubts = [rounding_error, *(newest or endless)]
        self._doubt = Deviation(*(max(part) for part in zip(*doubts, strict=True)))

    def _longest_passing(self, stepper: Stepper) -> Tried:
        """Return the run with a method's longest accurate step, of those that were run.

        Raises
        ------
        SceneError
            No run is accurate enough; the message states the best possible accuracy.
        """
        runs = [one for one in self._trials.tried if one.stepper is stepper]
        for one in runs:
            if self._passes(one):
                return one
        best = min(runs, key=lambda one: self._share(self._error(one)))
        error = self._error(best)
        missed = [
            f"accuracy.{key} = {exact(tolerance)} {unit}: the best possible is about "
            f"{_rounded_up(SAFETY * measured):g} {unit}"
            for key, tolerance, measured, unit in (
                ("angle", self.requested.angle, error.angle, "rad"),
                ("whirl", self.requested.whirl, error.whirl, self.scene.whirl_unit[1]),
            )
            if tolerance is not None and SAFETY * measured > tolerance
        ]
        reason = "a shorter step is not tried"
        if self._stalled:
            reason = (
                "shorter steps bring runs of this scene no closer to each other, because the "
                "motion amplifies rounding errors"
            )
        raise SceneError(
            f"{'; '.join(missed)}, with {_setting_of(best)} and a safety factor of "
            f"{SAFETY:g}: {reason}; choose a larger tolerance"
        )

    def _cheaper(self, stepper: Stepper, least: float) -> list[Tried]:
        """Return the run of a method with its longest accurate step; empty if it is not cheaper.

        Parameters
        ----------
        stepper
            Method to try.
        least
            CPU time of the cheapest run so far [s].
        """
        rungs = self._trials.rungs(stepper)
        at, failed = 0, -1
        while at < len(rungs):
            if self._trials.expected(stepper, rungs[at], like=self._usual) > ALIKE * least:
                return []
            tried = self._trials.run(stepper, rungs[at])
            if tried is not None and self._passes(tried):
                # The expected step may be too short: try longer ones while they pass.
                for longer in range(at - 1, failed, -1):
                    better = self._trials.run(stepper, rungs[longer])
                    if better is None or not self._passes(better):
                        break
                    tried = better
                return [tried]
            failed, wanted = at, 0.0
            if tried is not None:
                # The error falls with the power ``order`` of the step. The factor 0.9 aims at a
                # slightly longer step than that, as a step that is too short costs more.
                ratio = SAFETY * self._share(self._error(tried))
                wanted = 0.9 * rungs[at] * ratio ** (1.0 / stepper.order)
            at += 1
            while at < len(rungs) and rungs[at] < wanted:
                at += 1
        return []

    def _within_tolerance(self, stepper: Stepper) -> list[Tried]:
        """Return the largest accurate tolerance of a method with tolerances."""
        radius, unit = self.scene.race.radius, self.scene.whirl_unit[0]
        limits = [
            self.requested.angle,
            self.requested.whirl and self.requested.whirl * unit / radius,
        ]
        allowed = parameters_of(stepper.name)["tolerance"]
        largest = min(*(one for one in limits if one is not None), allowed.highest)
        (rung, *_), first = self._trials.rungs(stepper), math.floor(math.log10(largest))
        for power in range(first, first - _TOLERANCES, -1):
            tolerance = max(10.0**power, allowed.lowest)
            tried = self._trials.run(stepper, rung, {"tolerance": tolerance})
            if tried is None:
                return []
            if self._passes(tried):
                return [tried]
        return []

    def _between(self, one: Tried, other: Tried) -> Deviation:
        """Return the largest differences between two runs, at times sampled in both runs."""
        common = math.gcd(one.kept, other.kept)
        a, b = (samples.samples.every(samples.kept // common) for samples in (one, other))
        return deviation(a, b, self.scene.whirl_unit[0])

    def _share(self, error: Deviation) -> float:
        """Return the larger ratio of error to requested accuracy; at most 1 if both are met."""
        return share_of(self.requested, error.angle, error.whirl)

    def _passes(self, tried: Tried) -> bool:
        return SAFETY * self._share(self._error(tried)) <= 1.0


def _setting_of(tried: Tried) -> str:
    return setting(tried.stepper.name, tried.step, tried.parameters)


def _rounded_up(value: float) -> float:
    """Round up to two digits, so that a request of this accuracy succeeds."""
    if not 0.0 < value < math.inf:
        return value
    digit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.ceil(value / digit * (1 - 1e-12)) * digit


def resolve_accuracy(
    scene: Scene,
    period: float | None = None,
    commanded: bool = False,
    tell: Progress | None = None,
) -> tuple[Scene, WorkPrecision | None]:
    """Return the scene with the cheapest solver that delivers its requested accuracy.

    Errors are measured on the scene's own run, over its profile and duration, which may take
    minutes. Commands of a live drive are unknown, so they are not part of that run. A profile
    controlled during the run is replaced by its plan, see ``Scene.planned``.

    Parameters
    ----------
    scene
        Scene; without a requested accuracy it is returned unchanged, with None.
    period
        Period of a live node [s], which must be a multiple of the step; None for any step.
    commanded
        Whether the step must be stable up to ``spindle.max_speed``.
    tell
        Called before each run with the setting, and the CPU time spent and allowed [s].

    Returns
    -------
    tuple[Scene, WorkPrecision | None]
        The scene with its solver, and the solver's measured error and cost.

    Raises
    ------
    SceneError
        The accuracy cannot be reached; the message states the best possible one.
    DivergedError
        The scene's run diverges with every step.
    """
    if scene.accuracy is None:
        return scene, None
    return cheapest(scene, _timed_run, period, commanded, tell)


def _timed_run(scene: Scene, steps: int, every: int) -> Timed:
    """Run a scene along its planned profile, and measure the CPU time; see ``trials.Run``."""
    drive = Drive(scene.planned)
    begin = time.thread_time()
    taken = drive.advance(steps, every)
    seconds = time.thread_time() - begin
    return Timed(Samples.of(taken), seconds)
