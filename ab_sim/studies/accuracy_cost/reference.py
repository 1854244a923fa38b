"""What all runs of a scene are compared with, and how far that itself may be wrong.

Two makers who share nothing but the equations would have to be wrong alike for that to be too
little. Without events there are such: collocation and SciPy. With events both are the package's own
and a mistake in the laws of friction and contact, or in where events are found, would be in both:
those are compared with a simulator of its own in the package's tests, not here.
"""

import math
from typing import NamedTuple

from ab_sim.accuracy.deviation import Deviation, Samples, deviation, rounding
from ab_sim.errors import InputError, SceneError
from ab_sim.integrate.steppers.rk8 import RK8
from ab_sim.integrate.steppers.tsit5 import TSIT5
from ab_sim.scene.model import Scene
from ab_sim.studies.accuracy_cost.collocation import NODES, collocate, step_for
from ab_sim.studies.accuracy_cost.methods import FailedError
from ab_sim.studies.accuracy_cost.ours import OwnStepper
from ab_sim.studies.accuracy_cost.right_hand_side import RightHandSide
from ab_sim.studies.accuracy_cost.sampling import LADDER, SampleTimes
from ab_sim.studies.accuracy_cost.scipy_peers import dop853, lsoda, radau
from ab_sim.studies.accuracy_cost.tolerance import ByTolerance

TIGHT, TIGHT_STIFF = 2.5e-14, 1e-10
MOST_COLLOCATED = 1_500_000
"""Collocation steps; beyond that the drag is stiff enough for SciPy's implicit method."""
SHORT = (5e-5, 2e-5, 1e-5, 5e-6, 2e-6, 1e-6, 5e-7, 2e-7, 1e-7)
"""Steps for references with events [s]; the longest that is stable is taken."""
MOST_STEPS = 10_000_000
EQUATIONS = ("equations of motion",)
OURS = (*EQUATIONS, "laws of friction and contact", "steppers", "location of events")


class Reference(NamedTuple):
    """A run to compare with."""

    text: str
    """What it is, for people."""
    shares: tuple[str, ...]
    """What it has in common with the package's methods that it judges: with ``EQUATIONS`` alone it
    is independent of them."""
    uncertainty: Deviation
    """How far its two makers are apart, at most over the run (at its end, one instant, they may
    agree by chance); and no less than rounding."""
    first: Samples
    second: Samples
    judged_by_second: tuple[str, ...]
    """Methods that the second is for, because the first was made with them."""

    def samples_for(self, method: str) -> Samples:
        """The run that a method is compared with: never one it made itself."""
        return self.second if method in self.judged_by_second else self.first


def smooth_reference(f: RightHandSide) -> Reference:
    """Of a scene without events: Gauss' collocation beside DOP853; if very stiff, Radau, LSODA.

    Raises:
        InputError: both could not be made.
    """
    f = f.sampled(f.sampling.finest)
    step = min(step_for(f), f.sampling.period)
    steps = f.sampling.end / step
    try:
        if steps <= MOST_COLLOCATED:
            first = f.samples(collocate(f, step))
            second = _by_tolerance(f, "DOP853", TIGHT)
            text = (
                f"Gauss collocation of order {2 * NODES} at {step:.3g} s, checked by SciPy's "
                f"DOP853 at rtol {TIGHT:g}"
            )
        else:
            first, second = (_by_tolerance(f, name, TIGHT_STIFF) for name in ("Radau", "LSODA"))
            text = (
                f"SciPy's Radau at rtol {TIGHT_STIFF:g}, checked by its LSODA at the same; the "
                "drag is too stiff for collocation"
            )
    except FailedError as error:
        raise InputError(
            f"{f.scene.name}: no reference could be made: {error}; try a shorter duration"
        ) from error
    judged_by_second = () if steps <= MOST_COLLOCATED else ("Radau",)
    return Reference(
        text, EQUATIONS, _apart(f.scene, first, second), first, second, judged_by_second
    )


def _by_tolerance(f: RightHandSide, name: str, tolerance: float) -> Samples:
    solver = {"DOP853": dop853, "LSODA": lsoda, "Radau": radau}[name]
    run = ByTolerance(f, None, name, solver, tolerance)
    return run.samples(run.run())


def event_reference(scene: Scene, sampling: SampleTimes) -> Reference:
    """Of a scene with events: rk8 at a short step, and tsit5 for rk8 itself.

    Nobody else here locates events, so both use the package's code for that, and share its
    equations; they differ in method, steps, and in where events fall within steps.

    Raises:
        InputError: no step is short enough, or one of them diverged.
    """
    made: dict[str, tuple[float, Samples]] = {}
    # Steps that differ: with equal ones, even rounding errors would be alike.
    below = math.inf
    for name in (RK8.name, TSIT5.name):
        run, step = _shortest(scene, sampling, name, below)
        below = step
        try:
            made[name] = step, run.samples(run.run())
        except FailedError as error:
            raise InputError(
                f"{scene.name}: no reference could be made with {name} at {step:g} s: {error}"
            ) from error
    (step, first), (other, second) = made[RK8.name], made[TSIT5.name]
    text = (
        f"rk8 at {step:g} s, cross-checked by tsit5 at {other:g} s, by which rk8 is judged; both "
        "locate events by the package's own code, because the peers here do not"
    )
    return Reference(text, OURS, _apart(scene, first, second), first, second, (RK8.name,))


def _shortest(
    scene: Scene, sampling: SampleTimes, stepper: str, below: float
) -> tuple[OwnStepper, float]:
    refusal = ""
    for step in SHORT:
        if step >= below:
            continue
        if sampling.finest.per_period(step) and sampling.end / step <= MOST_STEPS:
            try:
                return OwnStepper(scene, sampling, stepper, step), step
            except SceneError as error:
                refusal = str(error)
    raise InputError(
        f"{scene.name}: no reference could be made with {stepper} at steps down to {SHORT[-1]:g} s"
        f" and at most {MOST_STEPS} of them: {refusal or 'the run is too long'}; try a shorter "
        "duration, or less drag"
    )


def _apart(scene: Scene, first: Samples, second: Samples) -> Deviation:
    apart = deviation(second, first, scene.whirl_unit[0])
    least = rounding(first, scene.whirl_unit[0])
    angle, whirl = max(apart.angle, least.angle), max(apart.whirl, least.whirl)
    return Deviation(angle, whirl, angle, whirl)


assert SHORT[0] < LADDER[0], "the reference's steps are shorter than those it judges"
