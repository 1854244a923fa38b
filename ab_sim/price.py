"""The cheapest stepper and step that are measured to deliver the accuracy a scene asks for.

Nothing is known beforehand of the error of a method on a scene: it depends on the passage through
resonance, on events, on everything. So the scene's own run is done with one setting after the
other, which takes some milliseconds each for a start-up of seconds:

1. The method of the highest order runs with shorter and shorter steps until two neighbours differ
   by far less than what is asked. The last run is the reference; what it differs by from the one
   before bounds what is left of its own error, rounding that events amplify included. If shorter
   steps do not bring it down any more, that is the best that double precision gives here.
2. The other methods run with the steps that their order lets expect to be enough, as long as they
   can be cheaper than what has been found.
3. Of each method the longest step whose error, times ``SAFETY``, is within what is asked is timed
   again, in turns. The cheapest one is taken; of those that cost the same within ``ALIKE``, which
   a clock cannot tell apart, the most accurate one: errors are the same in every measurement, so
   that the choice is, too, but for prices at the very edge of that. What was chosen is part of the
   results, and it, not the wish, is what a recording holds.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ab_sim.deviation import Deviation, deviation, rounding
from ab_sim.dynamics.assemble import DRAG, linear_rates, system_of
from ab_sim.errors import DivergedError, SceneError
from ab_sim.integrate.limits import largest_step
from ab_sim.integrate.registry import Stepper
from ab_sim.integrate.rk4 import RK4
from ab_sim.integrate.rk8 import RK8
from ab_sim.integrate.sweeps import SWEEPS
from ab_sim.integrate.tsit5 import TSIT5
from ab_sim.scene.load import check_scene
from ab_sim.scene.model import Accuracy, Scene

SAFETY = 4.0
"""What the measured error is multiplied by before it is compared with what is asked."""
ALIKE = 1.15
"""Prices whose ratio is below this are the same: CPU times of short runs scatter so much."""
_SHARPER = 10.0
"""How much less than the error allowed, ``SAFETY`` included, the references may differ by."""
_STALLED = 3
"""Refinements in a row that fail to halve the references' difference: rounding is reached."""
_DRAG_PAYS = 4.0
"""A step of ``sweeps`` costs about three of rk8's: it is looked at where it can be longer by this.
"""
_DRAG_RULES = 20.0
"""Where it can be longer by this, the explicit methods are not looked at any more."""
_RUNGS = tuple(c * 10**d for d in range(4) for c in (1, 2, 4, 5))
"""Steps are the longest one divided by these: 10, 5, 2.5, 2, 1 ms ..."""
_FEWEST = 4
"""Steps to choose from that a period has to leave."""
_MOST_SAMPLES = 200_000
"""Of a run, for comparing; of a longer one every so-manieth sample is kept."""
_MOST_SECONDS = 300.0
"""CPU time for measuring after which it is given up."""
_ROUNDS, _ENOUGH = 5, 1.0
"""Finalists are timed in this many rounds, or in fewer that have taken this long [s]."""


class Sampled(NamedTuple):
    """A run, done: deck and balls at equally spaced times, and what it took."""

    position: np.ndarray
    """Deck displacement on inertial axes [m], shape (samples, 2)."""
    angles: np.ndarray
    """theta of each ball [rad], shape (samples, balls)."""
    seconds: float
    """CPU time of the steps."""


Run = Callable[[Scene, int, int], Sampled]
"""Runs a scene from its start: so many steps, of which every so-manieth is kept."""


class Price(NamedTuple):
    """The setting taken, what error was measured with it, and what it costs."""

    asked: Accuracy
    stepper: str
    step: float
    """s."""
    measured: Deviation
    """Largest error over the scene's run, without safety factor; the reference's is included."""
    unit: str
    """Of the whirl's error: e, or R, the race's radius."""
    seconds: float
    """CPU time per simulated second, as measured when the choice was made."""

    @property
    def reason(self) -> str:
        """For people: what was measured, asked and paid."""
        measured, asked = [], []
        for wish, error, unit in (
            (self.asked.angle, self.measured.angle, "rad"),
            (self.asked.whirl, self.measured.whirl, self.unit),
        ):
            if wish is not None:
                measured.append(f"{error:.1e} {unit}")
                asked.append(f"{wish:g} {unit}")
        return (
            f"{self.stepper} at {1e3 * self.step:g} ms: measured error {', '.join(measured)} "
            f"(asked {', '.join(asked)}, safety factor {SAFETY:g}), "
            f"{1e6 * self.seconds:.0f} us of CPU time per simulated second"
        )

    def report(self) -> dict[str, Any]:
        """The same as JSON-able values, SI units, the whirl in ``whirl_unit``."""
        return {
            "asked": self.asked.model_dump(exclude_none=True),
            "measured": {"angle": self.measured.angle, "whirl": self.measured.whirl},
            "whirl_unit": self.unit,
            "safety_factor": SAFETY,
            "cpu_seconds_per_simulated_second": self.seconds,
            "reason": self.reason,
        }


def cheapest(scene: Scene, run: Run, period: float | None = None) -> tuple[Scene, Price]:
    """The scene with the solver that delivers the accuracy it asks for at the least price.

    Args:
        scene: asks for an accuracy.
        run: runs a scene.
        period: s; the step goes into it a whole number of times, as a live node needs it.

    Raises:
        SceneError: what is asked for cannot be had, or not be measured in a sensible time; says
            what can.
        DivergedError: the scene's run diverges with every step.
    """
    search = _Search(scene, run, period)
    tried = search.settle()
    assert scene.accuracy is not None
    price = Price(
        scene.accuracy,
        tried.stepper.name,
        tried.step,
        search.error(tried),
        scene.whirl_unit[1],
        tried.seconds / search.length,
    )
    return tried.scene, price


@dataclass
class _Tried:
    """A setting that has been run."""

    scene: Scene
    stepper: Stepper
    rung: int
    kept: int
    """Samples per longest step; it divides the rung."""
    samples: Sampled
    seconds: float
    """The least time that its run has taken."""

    @property
    def step(self) -> float:
        return self.scene.solver.step


class _Search:
    def __init__(self, scene: Scene, run: Run, period: float | None) -> None:
        assert scene.accuracy is not None
        self.scene, self.asked, self._run = scene, scene.accuracy, run
        rates = linear_rates(system_of(scene), scene.spindle.max_speed)
        beside_drag = {what: rate for what, rate in rates.items() if what != DRAG}
        self._longest = {s.name: largest_step(s, rates)[0] for s in (RK8, TSIT5, RK4)}
        self._longest[SWEEPS.name] = largest_step(SWEEPS, beside_drag)[0]
        # How much longer steps of rk8 could be if it were not for the drag.
        self._drag_costs = largest_step(RK8, beside_drag)[0] / self._longest[RK8.name]
        self._first: Stepper = SWEEPS if self._drag_costs >= _DRAG_RULES else RK8
        longest = min(max(self._longest.values()), 1.0)
        base = period or 10.0 ** max(math.ceil(math.log10(longest) - 1e-9), -6)
        self._base = round(1e9 * base)
        """ns: the longest step; all others are parts of it."""
        if period is not None and len(self._rungs(self._first)) < _FEWEST:
            raise SceneError(
                f"accuracy: a step has to go into the period of {period:g} s ({1 / period:g} 1/s) "
                "a whole number of times, be whole nanoseconds and stable, which too few are; a "
                "rate of 50, 100, 125, 200, 250, 500 or 1000 1/s would do, or a solver of your own"
            )
        bases = max(1, math.ceil(scene.duration / (1e-9 * self._base) - 1e-9))
        self._stride = math.ceil(bases / _MOST_SAMPLES)
        self._bases = self._stride * math.ceil(bases / self._stride)
        self.length = 1e-9 * self._base * self._bases
        """How long the run is that is measured [s]: the scene's, up to a whole step."""
        self._spent = 0.0
        self._per_step: dict[str, float] = {}
        """Least CPU time per step so far."""
        self._tried: list[_Tried] = []

    def settle(self) -> _Tried:
        self._find_reference()
        found = [self._longest_passing(self._first)]
        if self._first is RK8:
            others: list[Stepper] = [TSIT5, RK4]
            if self._drag_costs >= _DRAG_PAYS and found[0].rung == self._rungs(RK8)[0]:
                others.append(SWEEPS)
            for stepper in others:
                found += self._cheaper(stepper, min(one.seconds for one in found))
        self._time_again(found)
        least = min(one.seconds for one in found)
        alike = [one for one in found if one.seconds <= ALIKE * least]
        return min(alike, key=lambda one: self._share(self.error(one)))

    def error(self, tried: _Tried) -> Deviation:
        """How far a run may be from the truth: from the reference, and that one's own doubt."""
        if tried is self._reference:
            return self._doubt
        found = self._between(tried, self._reference)
        return Deviation(*(a + b for a, b in zip(found, self._doubt, strict=True)))

    def _find_reference(self) -> None:
        """Shorten the step of the first method until that changes nothing that matters."""
        differences: list[Deviation] = []
        least, stalled = math.inf, 0
        previous: _Tried | None = None
        for rung in self._rungs(self._first):
            tried = self._try(self._first, rung, last=rung == self._rungs(self._first)[-1])
            if tried is None:
                continue
            if previous is not None:
                differences.append(self._between(previous, tried))
                share = self._share(differences[-1])
                stalled = 0 if share < 0.5 * least else stalled + 1
                least = min(least, share)
                if _SHARPER * SAFETY * share <= 1.0 or stalled == _STALLED:
                    previous = tried
                    break
            previous = tried
        assert previous is not None, "the last one of all would have raised"
        self._reference = previous
        newest = differences[-stalled:] if stalled else differences[-1:]
        endless = [Deviation(*(math.inf,) * 4)]
        samples = self._reference.samples
        floor = rounding(samples.position, samples.angles, self.scene.whirl_unit[0])
        doubts = [floor, *(newest or endless)]
        self._doubt = Deviation(*(max(part) for part in zip(*doubts, strict=True)))

    def _longest_passing(self, stepper: Stepper) -> _Tried:
        runs = [one for one in self._tried if one.stepper is stepper]
        for one in runs:
            if self._passes(one):
                return one
        best = min(runs, key=lambda one: self._share(self.error(one)))
        error = self.error(best)
        wishes = [
            f"accuracy.{key} = {wish:g} {unit}: the best that can be had is about "
            f"{_rounded_up(SAFETY * found):g} {unit}"
            for key, wish, found, unit in (
                ("angle", self.asked.angle, error.angle, "rad"),
                ("whirl", self.asked.whirl, error.whirl, self.scene.whirl_unit[1]),
            )
            if wish is not None and SAFETY * found > wish
        ]
        raise SceneError(
            f"{'; '.join(wishes)}, with {best.stepper.name} at {1e3 * best.step:g} ms and a safety "
            f"factor of {SAFETY:g}: shorter steps bring runs of this scene no closer to each "
            "other, because of rounding and of what its events make of it; ask for no more"
        )

    def _cheaper(self, stepper: Stepper, price: float) -> list[_Tried]:
        """The longest step of another method that is accurate enough, if it can be cheaper."""
        rungs = self._rungs(stepper)
        at, failed = 0, -1
        while at < len(rungs):
            guess = self._per_step.get(stepper.name)
            if guess is None:
                guess = self._per_step[RK8.name] * stepper.stages / RK8.stages
            if guess * self._bases * rungs[at] > ALIKE * price:
                return []
            tried = self._try(stepper, rungs[at])
            if tried is not None and self._passes(tried):
                # What was expected may have been too careful: longer steps, while they pass.
                for longer in range(at - 1, failed, -1):
                    better = self._try(stepper, rungs[longer])
                    if better is None or not self._passes(better):
                        break
                    tried = better
                return [tried]
            failed, wanted = at, 0.0
            if tried is not None:
                ratio = SAFETY * self._share(self.error(tried))
                wanted = 0.9 * rungs[at] * ratio ** (1.0 / stepper.order)
            at += 1
            while at < len(rungs) and rungs[at] < wanted:
                at += 1
        return []

    def _time_again(self, found: list[_Tried]) -> None:
        """In turns, so that what else the machine does falls on all of them."""
        spent = 0.0
        for _ in range(_ROUNDS):
            for one in found:
                seconds = self._go(one.scene, one.rung, one.rung).seconds
                one.seconds = min(one.seconds, seconds)
                spent += seconds
            if spent > _ENOUGH:
                return

    def _rungs(self, stepper: Stepper) -> list[int]:
        longest = self._longest[stepper.name]
        return [
            rung
            for rung in _RUNGS
            if self._base % rung == 0 and 1e-9 * self._base / rung <= min(longest, 1.0)
        ]

    def _try(self, stepper: Stepper, rung: int, last: bool = False) -> _Tried | None:
        """Run a setting; None if it diverges, or the scene does not take that step.

        Raises:
            SceneError, DivergedError: the same, of the ``last`` one.
        """
        try:
            scene = with_solver(self.scene, stepper.name, 1e-9 * (self._base // rung))
            first = stepper.name not in self._per_step
            if first:
                # Twice: the first time kernels may be compiled.
                for _ in range(2):
                    probe = self._go(scene, rung, rung, bases=max(1, min(self._bases, 500 // rung)))
                    self._note(stepper, probe, max(1, min(self._bases, 500 // rung)) * rung)
            self._afford(stepper, rung)
            kept = max(
                k for k in _RUNGS if rung % k == 0 and (k == 1 or k * self._bases <= _MOST_SAMPLES)
            )
            samples = self._go(scene, rung, kept)
        except (DivergedError, SceneError) as error:
            if last or isinstance(error, _TooExpensive):
                raise
            return None
        self._note(stepper, samples, self._bases * rung)
        tried = _Tried(scene, stepper, rung, kept, samples, samples.seconds)
        self._tried.append(tried)
        return tried

    def _go(self, scene: Scene, rung: int, kept: int, bases: int | None = None) -> Sampled:
        bases = bases or self._bases
        stride = rung // kept * (self._stride if kept == 1 and bases == self._bases else 1)
        samples = self._run(scene, bases * rung, stride)
        self._spent += samples.seconds
        return samples

    def _note(self, stepper: Stepper, samples: Sampled, steps: int) -> None:
        before = self._per_step.get(stepper.name, math.inf)
        self._per_step[stepper.name] = min(before, samples.seconds / steps)

    def _afford(self, stepper: Stepper, rung: int) -> None:
        needed = self._per_step[stepper.name] * self._bases * rung
        if self._spent + needed > _MOST_SECONDS:
            raise _TooExpensive(
                f"accuracy: finding what delivers it would take more than {_MOST_SECONDS:g} s of "
                f"CPU time, because a run of duration = {self.scene.duration:g} s is an expensive "
                "one; find a solver with a shorter duration, and name its stepper and step"
            )

    def _between(self, one: _Tried, other: _Tried) -> Deviation:
        common = math.gcd(one.kept, other.kept)
        a, b = one.kept // common, other.kept // common
        return deviation(
            one.samples.position[a - 1 :: a],
            one.samples.angles[a - 1 :: a],
            other.samples.position[b - 1 :: b],
            other.samples.angles[b - 1 :: b],
            self.scene.whirl_unit[0],
        )

    def _share(self, error: Deviation) -> float:
        """The error as a share of what is asked."""
        return share_of(self.asked, error.angle, error.whirl)

    def _passes(self, tried: _Tried) -> bool:
        return SAFETY * self._share(self.error(tried)) <= 1.0


class _TooExpensive(SceneError):
    """Measuring would take too long."""


def share_of(asked: Accuracy, angle: float, whirl: float) -> float:
    """Errors as a share of what is asked, the larger one: at most 1 where they are within it."""
    shares = [
        error / wish
        for error, wish in ((angle, asked.angle), (whirl, asked.whirl))
        if wish is not None
    ]
    return max(shares)


def _rounded_up(value: float) -> float:
    """To two digits, so that who asks for it gets it."""
    if not 0.0 < value < math.inf:
        return value
    digit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.ceil(value / digit * (1 - 1e-12)) * digit


def with_solver(scene: Scene, stepper: str, step: float) -> Scene:
    """The scene with this solver, and no wish.

    Raises:
        SceneError: it does not take that step.
    """
    raw = {key: value for key, value in scene.as_mapping().items() if key != "accuracy"}
    raw["solver"] = {"stepper": stepper, "step": round(step, 12)}
    return check_scene(raw, scene.name)
