"""Step of the generalized-alpha method, solved by Newton's method with exact derivatives.

The method is that of Jansen, Whiting and Hulbert (2000), Comput. Methods Appl. Mech. Engrg. 190,
305-319, for first-order systems. From y_n, and y'_n in its memory, a step of length h solves

    y'_{n+am} = f(t + af h, y_{n+af})
    y'_{n+am} = y'_n + am (y'_{n+1} - y'_n),      y_{n+af} = y_n + af (y_{n+1} - y_n)
    y_{n+1} = y_n + h (y'_n + gamma (y'_{n+1} - y'_n))

for d = y_{n+af} - y_n.
"""

import math
from typing import NamedTuple

from ab_sim.engine.compiling.kinds import Floats, Table, call
from ab_sim.engine.events.run import Run
from ab_sim.engine.stepping.fixed_step import begin_range, complete_step
from ab_sim.engine.stepping.plan import EqualSteps

KEPT = 6
"""Number of Newton iterations after which the Jacobian is computed again."""
MOST = 60
"""Maximum number of iterations; a step that needs more returns a state that is not finite."""
CLOSE, SETTLED = 1e-14, 1e-7
"""Relative corrections at which the iteration ends, as fractions of the step's change: at once
below ``CLOSE``; below ``SETTLED`` once they no longer shrink, because they are then rounding."""


class ImplicitSteps(NamedTuple):
    """Run with steps of the generalized-alpha method."""

    run: Run
    slope: int
    """Address of the emitted slope(c, b, y, k, time); see ``ab_sim.engine.kernels``."""
    tangent: int
    """Address of the emitted tangent(c, b, t, y, d, out); see ``tangent_address``."""
    mass: float
    """Parameter alpha_m of the method: fraction of the step at which y' is evaluated."""
    force: float
    """Parameter alpha_f of the method: fraction of the step at which f is evaluated."""
    newmark: float
    """Parameter gamma of the method."""
    time: Floats
    """Time of an evaluation, shape (1,)."""
    at: Floats
    """State of an evaluation, shape (states,)."""
    slope_there: Floats
    """Slope at that state, shape (states,)."""
    change: Floats
    """Change of the state up to where f is taken, d = y_{n+af} - y_n, shape (states,)."""
    along: Table
    """Directions in the states, and the change of time, shape (states + 1, lanes)."""
    rates: Table
    """Derivatives of the slope along the directions, shape (states, lanes)."""
    jacobian: Table
    """Jacobian of the slope, shape (states, states)."""
    equations: Table
    """Matrix and right-hand side of Newton's equations; shape (states, states + 1)."""

    def begin(self, steps: EqualSteps, count: int, samples: Table) -> None:
        """Evaluate the equations at the present state: see ``advance.Method``."""
        begin_range(self.run, steps.time_after(0), count, samples)

    def take(self, steps: EqualSteps, k: int, sample: Floats) -> bool:
        """Take and record the k-th step: see ``advance.Method``."""
        _take_step(self, steps.time_after(k), steps.length)
        return complete_step(self.run, steps, k + 1, False, sample)


def _take_step(work: ImplicitSteps, begin: float, length: float) -> None:
    """Take one step and write its result into ``trial``; times are local [s].

    The slope at the beginning must be in ``run.work.slope``.
    """
    run = work.run
    am, af, gamma = work.mass, work.force, work.newmark
    state, past, d, at = run.state, run.work.memory[0], work.change, work.at
    equations, states = work.equations, run.state.size
    c, b = run.scene.c, run.balls.branches
    # A cleared memory, at the start or after a kink, begins with the present slope.
    fresh = True
    for j in range(states):
        if past[j] != 0.0:
            fresh = False
    for j in range(states):
        if fresh:
            past[j] = run.work.slope[j]
        d[j] = af * length * past[j]
    reach = af * gamma * length / am
    kept = length * af * (1.0 - gamma / am)
    work.time[0] = begin + af * length
    before, solved = math.inf, False
    for k in range(MOST):
        for j in range(states):
            at[j] = state[j] + d[j]
        call(work.slope, c, b, at, work.slope_there, work.time[0])
        # Simplified Newton: the Jacobian costs far more than a slope, and the start is so close
        # that an old one converges nearly as fast.
        if k % KEPT == 0:
            _differentiate(work)
        for i in range(states):
            for j in range(states):
                equations[i, j] = -reach * work.jacobian[i, j]
            equations[i, i] += 1.0
            equations[i, states] = reach * work.slope_there[i] + kept * past[i] - d[i]
        reduce(equations, states)
        # Deck and balls are tested separately: their states differ by orders of magnitude.
        balls = run.balls.first_angle
        change = max(
            _share_changed(work, reach, 0, balls), _share_changed(work, reach, balls, states)
        )
        for j in range(states):
            d[j] += equations[j, states]
        # Close to the solution, corrections that no longer shrink are rounding.
        if change <= CLOSE or (change < SETTLED and change > 0.5 * before):
            solved = True
            break
        before = change
    if not solved:
        d[0] = math.nan
    for j in range(states):
        run.work.trial[j] = state[j] + d[j] / af
        past[j] = (d[j] / (af * length) - (1.0 - gamma) * past[j]) / gamma


def _differentiate(work: ImplicitSteps) -> None:
    """Compute the Jacobian at the trial state and its time, several columns at once."""
    run = work.run
    states, lanes, first = run.state.size, work.along.shape[1], 0
    while first < states:
        for j in range(states + 1):
            for lane in range(lanes):
                work.along[j, lane] = 1.0 if j == first + lane else 0.0
        c, b = run.scene.c, run.balls.branches
        call(work.tangent, c, b, work.time, work.at, work.along, work.rates)
        for lane in range(min(lanes, states - first)):
            for i in range(states):
                work.jacobian[i, first + lane] = work.rates[i, lane]
        first += lanes


def _share_changed(work: ImplicitSteps, reach: float, first: int, end: int) -> float:
    """Return the largest correction of some states, relative to their largest change in the step.

    Both maxima are over the states from ``first`` to before ``end``. Single states are not
    compared, because one that stays at zero by symmetry contains only rounding.
    """
    size, most, column = 0.0, 0.0, work.change.size
    for j in range(first, end):
        size = max(size, abs(work.change[j]) + abs(reach * work.slope_there[j]))
        most = max(most, abs(work.equations[j, column]))
    return most / size if size > 0.0 else most


def reduce(table: Table, size: int) -> None:
    """Solve linear equations by Gauss-Jordan elimination with partial pivoting, in place.

    Parameters
    ----------
    table
        Matrix with the right-hand side in its last column, shape (size, size + 1). The last column
        holds the solution at the end.
    size
        Number of equations.
    """
    for p in range(size):
        best = p
        for r in range(p + 1, size):
            if abs(table[r, p]) > abs(table[best, p]):
                best = r
        scale = 1.0 / table[best, p]
        for c in range(p, size + 1):
            moved = table[best, c] * scale
            table[best, c] = table[p, c]
            table[p, c] = moved
        for r in range(size):
            factor = table[r, p]
            if r != p and factor != 0.0:
                for c in range(p, size + 1):
                    table[r, c] -= factor * table[p, c]
