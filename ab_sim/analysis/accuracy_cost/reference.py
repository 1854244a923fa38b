"""Reference solution of a scene, and its uncertainty.

The uncertainty is the difference of two solutions. Without events they come from collocation and
SciPy, which share only the equations, so a common error is unlikely. With events both use this
package's code, and an error in the laws of friction and contact, or in the event location, would
be in both. The package's tests compare those with an independent simulator.

Collocation has eight Gauss nodes and order 16:

    Y_i = y + h sum_j a_ij f(t + c_j h, Y_j),       y+ = y + h sum_j b_j f(t + c_j h, Y_j)

The method is implicit and belongs to another family than all methods that are compared with it.
(The package's rk8 and SciPy's DOP853 share their coefficients, so neither can judge the other.) The
stages are iterated to rounding. Increments are summed with Kahan's compensation, so that rounding
does not accumulate over the steps. Butcher (1964), Math. Comp. 18, 50-64.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from ab_sim.analysis.accuracy_cost.methods import SCIPY, ByTolerance, FailedError, OwnStepper
from ab_sim.analysis.accuracy_cost.problem import LADDER, RightHandSide, SampleTimes
from ab_sim.base.errors import InputError, SceneError
from ab_sim.drive.accuracy.trials import Deviation, Samples, deviation, rounding
from ab_sim.engine.compiling import compiled
from ab_sim.engine.compiling.kinds import Floats, Table, call
from ab_sim.engine.integrate.steppers.rk8 import RK8
from ab_sim.engine.integrate.steppers.tsit5 import TSIT5
from ab_sim.engine.integrate.vector_field import Field
from ab_sim.model.dynamics.assemble import linear_rates
from ab_sim.scene.model import Scene

NODES, _ITERATIONS = 8, 60
"""Number of collocation nodes, and largest number of iterations of a step."""
LONGEST = 1e-3
"""Longest step of the reference solution by collocation [s]."""
_STEP_TIMES_RATE = 1.0
"""Largest product of step and fastest rate; the iteration then converges in about 20 rounds."""
SETTLED = 3e-16
"""Change at which the iteration ends, relative to each state's magnitude."""


class CollocationCoefficients(NamedTuple):
    """Butcher tableau: nodes c, matrix a and weights b; shapes (s,), (s, s), (s,) for s nodes."""

    c: np.ndarray
    a: np.ndarray
    b: np.ndarray


class CollocationSteps(NamedTuple):
    """Equations, coefficients and work arrays for steps."""

    field: Field
    """Compiled right-hand side."""
    c: Floats
    """Nodes, shape (nodes,)."""
    a: Table
    """Matrix, shape (nodes, nodes)."""
    b: Floats
    """Weights, shape (nodes,)."""
    scale: Floats
    """Magnitudes of the states, shape (states,)."""
    rest: Floats
    """Kahan compensation of the state, shape (states,)."""
    slopes: Table
    """Slopes at the nodes, shape (nodes, states)."""
    ahead: Table
    """Slopes of the next iteration, shape (nodes, states)."""
    trial: Floats
    """State at a node, shape (states,)."""


def _lagrange(nodes: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return the Lagrange basis l_j on ``nodes`` at the points ``at``, shape (at, nodes)."""
    rows = [[np.prod([(t - y) / (x - y) for y in nodes if y != x]) for x in nodes] for t in at]
    return np.array(rows)


def integration(nodes: np.ndarray) -> np.ndarray:
    """Return the integrals of the Lagrange basis functions from 0 to each node.

    Gauss quadrature is exact up to rounding. Integrating in the monomial basis would lose four
    digits at eight nodes.

    Parameters
    ----------
    nodes
        Nodes c_m in [0, 1], shape (nodes,).

    Returns
    -------
    np.ndarray
        Q_mj, the integral of l_j from 0 to c_m, shape (nodes, nodes).
    """
    x, w = legendre.leggauss((len(nodes) + 1) // 2)
    return np.array([c / 2.0 * (w @ _lagrange(nodes, c * (x + 1.0) / 2.0)) for c in nodes])


def gauss_nodes(count: int = NODES) -> CollocationCoefficients:
    """Return the coefficients of Gauss collocation with ``count`` nodes."""
    x, w = legendre.leggauss(count)
    c = (x + 1.0) / 2.0
    return CollocationCoefficients(c, integration(c), w / 2.0)


def step_for(f: RightHandSide) -> float:
    """Return the longest step at which the iteration for a scene converges [s]."""
    rates = linear_rates(f.system, f.scene.spindle.max_speed).values()
    return min([LONGEST, *(_STEP_TIMES_RATE / abs(rate) for rate in rates if rate)])


def collocate(f: RightHandSide, longest: float) -> np.ndarray:
    """Return the states at the sample times by collocation, shape (samples, states).

    Parameters
    ----------
    f
        Right-hand side of the scene.
    longest
        Longest step [s].

    Raises
    ------
    FailedError
        The iteration does not converge at this step.
    """
    nodes, state, rest = gauss_nodes(), f.start.copy(), np.zeros(f.start.size)
    shape = (NODES, state.size)
    workspace = np.empty(shape), np.empty(shape), state.copy()
    kept = []
    for leg in f.legs:
        method = CollocationSteps(leg.field.emitted, *nodes, f.scale, rest, *workspace)
        states = [state.copy()]
        for begin, end in zip(leg.grid[:-1], leg.grid[1:], strict=True):
            steps = math.ceil((end - begin) / longest - 1e-9)
            length = (end - begin) / steps
            local = begin - leg.scheduled.start
            if not compiled(_take_steps)(method, local, length, steps, state):
                raise FailedError(
                    f"collocation does not converge at t = {begin:.6g} s with steps of {length:g} s"
                )
            states.append(state.copy())
        kept.append(np.array(states)[leg.keep])
    return np.concatenate(kept)


def _take_steps(
    collocation_steps: CollocationSteps, begin: float, length: float, steps: int, state: Floats
) -> bool:
    """Take equal steps by collocation; to be compiled.

    Parameters
    ----------
    collocation_steps
        Equations, coefficients and work arrays; the compensation ``rest`` is overwritten.
    begin
        Local time at the start [s].
    length
        Length of a step [s].
    steps
        Number of steps.
    state
        State at the start, overwritten by that at the end, shape (states,).

    Returns
    -------
    bool
        True if the iterations of all steps converged.
    """
    field, slopes, ahead, trial, rest = (
        collocation_steps.field,
        collocation_steps.slopes,
        collocation_steps.ahead,
        collocation_steps.trial,
        collocation_steps.rest,
    )
    count, states = collocation_steps.c.size, state.size
    for step in range(steps):
        time = begin + step * length
        call(field.slope, field.c, field.b, state, trial, time)
        for i in range(count):
            for j in range(states):
                slopes[i, j] = trial[j]
        # Fixed-point iteration of all stages from the slope at the step's start. It converges
        # because ``step_for`` limits the step by the fastest rate.
        settled, change = False, math.inf
        for _ in range(_ITERATIONS):
            change = 0.0
            for i in range(count):
                for j in range(states):
                    total = rest[j]
                    for k in range(count):
                        total += length * collocation_steps.a[i, k] * slopes[k, j]
                    trial[j] = state[j] + total
                at = time + collocation_steps.c[i] * length
                call(field.slope, field.c, field.b, trial, ahead[i], at)
                for j in range(states):
                    moved = abs(ahead[i, j] - slopes[i, j]) * length / collocation_steps.scale[j]
                    # Negated comparison, so that a NaN counts as a change.
                    if not moved <= change:
                        change = moved
            for i in range(count):
                for j in range(states):
                    slopes[i, j] = ahead[i, j]
            if change <= SETTLED:
                settled = True
                break
            if not change < 1e9:
                break
        # Rounding may keep the last digits from settling: accept changes up to 100 times as large.
        if not settled and not change <= 100.0 * SETTLED:
            return False
        # Kahan's compensated sum: ``rest`` keeps the part of the increment that the state loses.
        for j in range(states):
            total = rest[j]
            for k in range(count):
                total += length * collocation_steps.b[k] * slopes[k, j]
            summed = state[j] + total
            rest[j] = total - (summed - state[j])
            state[j] = summed
    return True


_TIGHT, _TIGHT_STIFF = 2.5e-14, 1e-10
"""Relative tolerances of SciPy's solutions, for other scenes and for very stiff ones.

2.5e-14 is slightly above the least that SciPy accepts, 100 times the rounding error.
"""
_MOST_COLLOCATED = 1_500_000
"""Maximum number of collocation steps; stiffer scenes use SciPy's implicit method."""
SHORT = (5e-5, 2e-5, 1e-5, 5e-6, 2e-6, 1e-6, 5e-7, 2e-7, 1e-7)
"""Steps for references with events [s]; the longest stable one is used."""
_MOST_STEPS = 10_000_000
"""Largest number of steps of a reference with events."""
EQUATIONS = ("equations of motion",)
"""Code that a reference without events shares with the package's methods."""
OURS = (*EQUATIONS, "laws of friction and contact", "steppers", "location of events")
"""Code that a reference with events shares with the package's methods."""


class Reference(NamedTuple):
    """Reference solution."""

    text: str
    """Description of the reference solution, for the user."""
    shares: tuple[str, ...]
    """Code shared with the package's methods; with ``EQUATIONS`` alone the reference is independent
    of them."""
    uncertainty: Deviation
    """Largest difference of the two solutions over the run, at least the rounding error. The end
    alone would not do: at one instant they may agree by chance."""
    first: Samples
    """Solution with which most methods are compared."""
    second: Samples
    """Solution that checks the first one."""
    judged_by_second: tuple[str, ...]
    """Methods compared with the second solution, because they computed the first solution."""

    def samples_for(self, method: str) -> Samples:
        """Return the solution for a method, never one that the method computed."""
        return self.second if method in self.judged_by_second else self.first


def smooth_reference(f: RightHandSide) -> Reference:
    """Return the reference solution of a scene without events.

    It is computed by Gauss collocation and checked by DOP853. For very stiff scenes, the two
    methods are Radau and LSODA.

    Raises
    ------
    InputError
        The two solutions could not be computed.
    """
    f = f.sampled(f.sampling.finest)
    step = min(step_for(f), f.sampling.period)
    steps = f.sampling.end / step
    try:
        if steps <= _MOST_COLLOCATED:
            first = f.samples(collocate(f, step))
            second = _by_tolerance(f, "DOP853", _TIGHT)
            text = (
                f"Gauss collocation of order {2 * NODES} at {step:.3g} s, checked by SciPy's "
                f"DOP853 at rtol {_TIGHT:g}"
            )
        else:
            first, second = (_by_tolerance(f, name, _TIGHT_STIFF) for name in ("Radau", "LSODA"))
            text = (
                f"SciPy's Radau at rtol {_TIGHT_STIFF:g}, checked by its LSODA at the same; the "
                "drag is too stiff for collocation"
            )
    except FailedError as error:
        raise InputError(
            f"{f.scene.name}: cannot compute a reference: {error}; try a shorter duration"
        ) from error
    judged_by_second = () if steps <= _MOST_COLLOCATED else ("Radau",)
    return Reference(
        text, EQUATIONS, _uncertainty(f.scene, first, second), first, second, judged_by_second
    )


def _by_tolerance(f: RightHandSide, name: str, tolerance: float) -> Samples:
    """Return the solution by a method of ``SCIPY`` at a relative tolerance."""
    run = ByTolerance(f, None, name, SCIPY[name], tolerance)
    return run.samples(run.run())


def event_reference(scene: Scene, sampling: SampleTimes) -> Reference:
    """Return the reference of a scene with events: rk8 at a short step, and tsit5 to judge rk8.

    The other packages here do not locate events, so both solutions use this package's equations
    and event location. They differ in method, steps, and the position of events within steps.

    Raises
    ------
    InputError
        No step is short enough, or a solution diverged.
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
    return Reference(text, OURS, _uncertainty(scene, first, second), first, second, (RK8.name,))


def _shortest(
    scene: Scene, sampling: SampleTimes, stepper: str, below: float
) -> tuple[OwnStepper, float]:
    """Return a stepper at the longest step of ``SHORT`` that is shorter than ``below`` [s].

    Raises
    ------
    InputError
        The scene refuses all these steps, or is too long for them.
    """
    refusal = ""
    for step in SHORT:
        if step >= below:
            continue
        if sampling.finest.per_period(step) and sampling.end / step <= _MOST_STEPS:
            try:
                return OwnStepper(scene, sampling, stepper, step), step
            except SceneError as error:
                refusal = str(error)
    raise InputError(
        f"{scene.name}: cannot compute a reference with {stepper}, steps of at least {SHORT[-1]:g} "
        f"s and at most {_MOST_STEPS} steps: {refusal or 'the run is too long'}; try a shorter "
        "duration, or less drag"
    )


def _uncertainty(scene: Scene, first: Samples, second: Samples) -> Deviation:
    """Return the difference of two solutions over the run, at least the rounding error."""
    apart = deviation(second, first, scene.whirl_unit[0])
    least = rounding(first, scene.whirl_unit[0])
    angle, whirl = max(apart.angle, least.angle), max(apart.whirl, least.whirl)
    return Deviation(angle, whirl, angle, whirl)


assert SHORT[0] < LADDER[0], "the reference's steps are shorter than those it judges"
