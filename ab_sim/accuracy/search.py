"""The cheapest stepper and step that are measured to deliver the accuracy a scene asks for.

Nothing is known beforehand of the error of a method on a scene: it depends on the passage through
resonance, on events, on everything. So the scene's own run is done with one setting after the
other, which takes some milliseconds each for a start-up of seconds:

1. The method of the highest order runs with shorter and shorter steps until two neighbours differ
   by far less than what is asked. The last run is the reference; what it differs by from the one
   before bounds what is left of its own error, rounding that events amplify included. If shorter
   steps do not bring it down any more, that is the best that double precision gives here. Its
   steps are such that other runs' steps end where one of its own does: just after a jump of the
   spindle's acceleration, errors peak for some milliseconds, which the longest steps leave out.
2. The other methods run with the steps that their order lets expect to be enough, as long as they
   can be cheaper than what has been found.
   One that keeps to a tolerance runs with as long a step as the first method can take, which only
   says how close samples are, and with tolerances from what is asked downwards.
3. Of each method the longest step whose error, times ``SAFETY``, is within what is asked is timed
   again, in turns. The cheapest one is taken; of those that cost the same within ``ALIKE``, which
   a clock cannot tell apart, the most accurate one: errors are the same in every measurement, so
   that the choice is, too, but for prices at the very edge of that. What was chosen is part of the
   results, and it, not the wish, is what a recording holds.
"""

import math

from ab_sim.accuracy.deviation import Deviation, deviation, rounding
from ab_sim.accuracy.price import SAFETY, Price, share_of
from ab_sim.accuracy.trials import Run, Trials, Tried
from ab_sim.dynamics.assemble import DRAG, linear_rates, system_of
from ab_sim.errors import SceneError, exact
from ab_sim.integrate.choose import USUAL, for_stiff_drag, limiting, top_speed
from ab_sim.integrate.limits import largest_step
from ab_sim.integrate.registry import parameters_of, stepper_named, steppers
from ab_sim.integrate.stepper import Stepper
from ab_sim.scene.model import Scene

ALIKE = 1.15
"""Prices whose ratio is below this are the same: CPU times of short runs scatter so much."""
SHARPER = 10.0
"""How much less than the error allowed, ``SAFETY`` included, the references may differ by."""
STALLED = 3
"""Refinements, one after the other, that fail to halve the references' difference: rounding is
reached. One that makes it larger by ``SHARPER`` shows instead that what came before it agreed by
chance."""
SHARED = 20
"""The reference's rung is a multiple of this: the steps of all shorter rungs, and every second or
fifth step of the others, then end at one of its samples."""
DRAG_PAYS = 4.0
"""``sweeps``, whose steps cost several of rk8's, is looked at where they can be longer by this."""
DRAG_RULES = 20.0
"""Where it can be longer by this, the explicit methods are not looked at any more."""
TOLERANCES = 6
"""So many, a power of ten apart each, are tried of a method that keeps to one."""
FEWEST = 4
"""Steps to choose from that a period has to leave."""


def cheapest(
    scene: Scene, run: Run, period: float | None = None, commanded: bool = False
) -> tuple[Scene, Price]:
    """The scene with the solver that delivers the accuracy it asks for at the least price.

    Args:
        scene: asks for an accuracy.
        run: runs a scene.
        period: s; the step goes into it a whole number of times, as a live node needs it.
        commanded: whether the step has to be stable up to ``spindle.max_speed``.

    Raises:
        SceneError: what is asked for cannot be had, or not be measured in a sensible time; says
            what can.
        DivergedError: the scene's run diverges with every step.
    """
    return _Search(scene, run, period, commanded).settle()


class _Search:
    def __init__(self, scene: Scene, run: Run, period: float | None, commanded: bool) -> None:
        assert scene.accuracy is not None
        self.scene, self.asked = scene, scene.accuracy
        rates = linear_rates(system_of(scene), top_speed(scene, commanded))
        beside_drag = {what: rate for what, rate in rates.items() if what != DRAG}
        known = [stepper for stepper in steppers().values() if stepper.priced]
        self._tolerant = [s for s in known if s.keeps_tolerance]
        by_step = [s for s in known if not s.keeps_tolerance]
        longest = {s.name: largest_step(s, limiting(s, rates))[0] for s in by_step}
        self._usual, self._for_drag = stepper_named(USUAL), for_stiff_drag()
        self._others = [s for s in by_step if s not in (self._usual, self._for_drag)]
        # How much longer steps of the usual one could be if it were not for the drag.
        self._drag_costs = largest_step(self._usual, beside_drag)[0] / longest[USUAL]
        self._first = self._for_drag if self._drag_costs >= DRAG_RULES else self._usual
        self._trials = Trials(scene, run, longest, period)
        if period is not None and len(self._trials.rungs(self._first)) < FEWEST:
            raise SceneError(
                f"accuracy: a step has to go into the period of {period:g} s ({1 / period:g} 1/s) "
                "a whole number of times, be whole nanoseconds and stable, which too few are; a "
                "rate of 50, 100, 125, 200, 250, 500 or 1000 1/s would do, or a solver of your own"
            )

    def settle(self) -> tuple[Scene, Price]:
        """Find the reference, then what is good enough, then what is cheapest."""
        self._find_reference()
        found = [self._longest_passing(self._first)]
        if self._first is self._usual:
            others = sorted(self._others, key=lambda stepper: -stepper.order)
            longest = self._trials.rungs(self._usual)[0]
            if self._drag_costs >= DRAG_PAYS and found[0].rung == longest:
                others.append(self._for_drag)
            for stepper in others:
                found += self._cheaper(stepper, min(one.seconds for one in found))
        for stepper in self._tolerant:
            found += self._within_tolerance(stepper)
        self._trials.time_again(found)
        least = min(one.seconds for one in found)
        alike = [one for one in found if one.seconds <= ALIKE * least]
        taken = min(alike, key=lambda one: self._share(self._error(one)))
        return taken.scene, Price(
            self.asked,
            taken.stepper.name,
            taken.step,
            taken.scene.solver.parameters,
            self._error(taken),
            f"{self._reference.stepper.name} at {1e3 * self._reference.step:g} ms",
            self.scene.whirl_unit[1],
            taken.seconds / self._trials.length,
        )

    def _error(self, tried: Tried) -> Deviation:
        """How far a run may be from the truth: from the reference, and that one's own doubt."""
        if tried is self._reference:
            return self._doubt
        found = self._between(tried, self._reference)
        return Deviation(*(a + b for a, b in zip(found, self._doubt, strict=True)))

    def _find_reference(self) -> None:
        """Shorten the step of the first method until that changes nothing that matters."""
        differences: list[Deviation] = []
        least, stalled, enough = math.inf, 0, False
        previous: Tried | None = None
        rungs = self._trials.rungs(self._first)
        for rung in rungs:
            if enough and rung % SHARED and rung != rungs[-1]:
                continue
            tried = self._trials.run(self._first, rung, last=rung == rungs[-1])
            if tried is None:
                continue
            if previous is not None:
                differences.append(self._between(previous, tried))
                share = self._share(differences[-1])
                if share > SHARPER * least:
                    least, stalled = share, 0
                else:
                    stalled = 0 if share < 0.5 * least else stalled + 1
                    least = min(least, share)
                enough = SHARPER * SAFETY * share <= 1.0 or stalled >= STALLED
            previous = tried
            if enough and rung % SHARED == 0:
                break
        assert previous is not None, "the last one of all would have raised"
        self._reference, self._stalled = previous, stalled >= STALLED
        newest = differences[-max(stalled, 1) :]
        endless = [Deviation(*(math.inf,) * 4)]
        doubts = [rounding(previous.samples, self.scene.whirl_unit[0]), *(newest or endless)]
        self._doubt = Deviation(*(max(part) for part in zip(*doubts, strict=True)))

    def _longest_passing(self, stepper: Stepper) -> Tried:
        runs = [one for one in self._trials.tried if one.stepper is stepper]
        for one in runs:
            if self._passes(one):
                return one
        best = min(runs, key=lambda one: self._share(self._error(one)))
        error = self._error(best)
        wishes = [
            f"accuracy.{key} = {exact(wish)} {unit}: the best that can be had is about "
            f"{_rounded_up(SAFETY * found):g} {unit}"
            for key, wish, found, unit in (
                ("angle", self.asked.angle, error.angle, "rad"),
                ("whirl", self.asked.whirl, error.whirl, self.scene.whirl_unit[1]),
            )
            if wish is not None and SAFETY * found > wish
        ]
        reason = "a shorter step is not tried"
        if self._stalled:
            reason = (
                "shorter steps bring runs of this scene no closer to each other, because of "
                "rounding and of what the motion makes of it"
            )
        raise SceneError(
            f"{'; '.join(wishes)}, with {best.stepper.name} at {1e3 * best.step:g} ms and a safety "
            f"factor of {SAFETY:g}: {reason}; ask for no more"
        )

    def _cheaper(self, stepper: Stepper, price: float) -> list[Tried]:
        """The longest step of another method that is accurate enough, if it can be cheaper."""
        rungs = self._trials.rungs(stepper)
        at, failed = 0, -1
        while at < len(rungs):
            if self._trials.expected(stepper, rungs[at], like=self._usual) > ALIKE * price:
                return []
            tried = self._trials.run(stepper, rungs[at])
            if tried is not None and self._passes(tried):
                # What was expected may have been too careful: longer steps, while they pass.
                for longer in range(at - 1, failed, -1):
                    better = self._trials.run(stepper, rungs[longer])
                    if better is None or not self._passes(better):
                        break
                    tried = better
                return [tried]
            failed, wanted = at, 0.0
            if tried is not None:
                ratio = SAFETY * self._share(self._error(tried))
                wanted = 0.9 * rungs[at] * ratio ** (1.0 / stepper.order)
            at += 1
            while at < len(rungs) and rungs[at] < wanted:
                at += 1
        return []

    def _within_tolerance(self, stepper: Stepper) -> list[Tried]:
        """The largest tolerance of a method that keeps to one which is accurate enough."""
        unit, radius = self.scene.whirl_unit[0], self.scene.race.radius
        wishes = (self.asked.angle, self.asked.whirl and self.asked.whirl * unit / radius)
        largest = math.floor(math.log10(min(wish for wish in wishes if wish is not None)))
        allowed = parameters_of(stepper.name)["tolerance"]
        rung = self._trials.rungs(self._first)[0]
        for power in range(largest, largest - TOLERANCES, -1):
            tolerance = min(max(10.0**power, allowed.lowest), allowed.highest)
            tried = self._trials.run(stepper, rung, parameters={"tolerance": tolerance})
            if tried is None:
                return []
            if self._passes(tried):
                return [tried]
            if tolerance == allowed.lowest:
                return []
        return []

    def _between(self, one: Tried, other: Tried) -> Deviation:
        common = math.gcd(one.kept, other.kept)
        a, b = (each.samples.every(each.kept // common) for each in (one, other))
        return deviation(a, b, self.scene.whirl_unit[0])

    def _share(self, error: Deviation) -> float:
        """The error as a share of what is asked."""
        return share_of(self.asked, error.angle, error.whirl)

    def _passes(self, tried: Tried) -> bool:
        return SAFETY * self._share(self._error(tried)) <= 1.0


def _rounded_up(value: float) -> float:
    """To two digits, so that who asks for it gets it."""
    if not 0.0 < value < math.inf:
        return value
    digit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.ceil(value / digit * (1 - 1e-12)) * digit
