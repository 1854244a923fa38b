"""Reference solution of a scene, and its uncertainty.

The uncertainty is the difference of two solutions. Without events they come from collocation and
SciPy, which share only the equations, so a common error is unlikely. With events both use this
package's code, and an error in the laws of friction and contact, or in the event location, would
be in both. The package's tests compare those with an independent simulator.
"""

import math
from typing import NamedTuple

from ab_sim.analysis.accuracy_cost.collocation import NODES, collocate, step_for
from ab_sim.analysis.accuracy_cost.methods import FailedError
from ab_sim.analysis.accuracy_cost.ours import OwnStepper
from ab_sim.analysis.accuracy_cost.right_hand_side import RightHandSide
from ab_sim.analysis.accuracy_cost.sampling import LADDER, SampleTimes
from ab_sim.analysis.accuracy_cost.scipy_peers import dop853, lsoda, radau
from ab_sim.analysis.accuracy_cost.tolerance import ByTolerance
from ab_sim.base.errors import InputError, SceneError
from ab_sim.drive.accuracy.deviation import Deviation, Samples, deviation, rounding
from ab_sim.engine.integrate.steppers.rk8 import RK8
from ab_sim.engine.integrate.steppers.tsit5 import TSIT5
from ab_sim.scene.model import Scene

TIGHT, TIGHT_STIFF = 2.5e-14, 1e-10
MOST_COLLOCATED = 1_500_000
"""Maximum number of collocation steps; stiffer scenes use SciPy's implicit method."""
SHORT = (5e-5, 2e-5, 1e-5, 5e-6, 2e-6, 1e-6, 5e-7, 2e-7, 1e-7)
"""Steps for references with events [s]; the longest stable one is used."""
MOST_STEPS = 10_000_000
EQUATIONS = ("equations of motion",)
OURS = (*EQUATIONS, "laws of friction and contact", "steppers", "location of events")


class Reference(NamedTuple):
    """Reference solution."""

    text: str
    """Description for the user."""
    shares: tuple[str, ...]
    """Code shared with the package's methods; with ``EQUATIONS`` alone the reference is independent
    of them."""
    uncertainty: Deviation
    """Largest difference of the two solutions over the run, at least the rounding error. The end
    alone would not do: at one instant they may agree by chance."""
    first: Samples
    second: Samples
    judged_by_second: tuple[str, ...]
    """Methods compared with the second solution, because they computed the first."""

    def samples_for(self, method: str) -> Samples:
        """Return the solution for a method, never one that the method computed."""
        return self.second if method in self.judged_by_second else self.first


def smooth_reference(f: RightHandSide) -> Reference:
    """Return the reference solution of a scene without events.

    It is computed by Gauss collocation and checked by DOP853. For very stiff scenes, the two
    methods are Radau and LSODA.

    Raises:
        InputError: the two solutions could not be computed.
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
            f"{f.scene.name}: cannot compute a reference: {error}; try a shorter duration"
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
    """Return the reference of a scene with events: rk8 at a short step, and tsit5 to judge rk8.

    The other packages here do not locate events, so both solutions use this package's equations
    and event location. They differ in method, steps, and the position of events within steps.

    Raises:
        InputError: no step is short enough, or a solution diverged.
    """
    runs_by_name: dict[str, tuple[float, Samples]] = {}
    # The steps differ: with equal ones, even rounding errors would be alike.
    below = math.inf
    for name in (RK8.name, TSIT5.name):
        run, step = _shortest(scene, sampling, name, below)
        below = step
        try:
            runs_by_name[name] = step, run.samples(run.run())
        except FailedError as error:
            raise InputError(
                f"{scene.name}: cannot compute a reference with {name} at {step:g} s: {error}"
            ) from error
    (step, first), (other, second) = runs_by_name[RK8.name], runs_by_name[TSIT5.name]
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
        f"{scene.name}: cannot compute a reference with {stepper}, steps of at least {SHORT[-1]:g} "
        f"s and at most {MOST_STEPS} steps: {refusal or 'the run is too long'}; try a shorter "
        "duration, or less drag"
    )


def _apart(scene: Scene, first: Samples, second: Samples) -> Deviation:
    apart = deviation(second, first, scene.whirl_unit[0])
    least = rounding(first, scene.whirl_unit[0])
    angle, whirl = max(apart.angle, least.angle), max(apart.whirl, least.whirl)
    return Deviation(angle, whirl, angle, whirl)


assert SHORT[0] < LADDER[0], "the reference's steps are shorter than those it judges"
