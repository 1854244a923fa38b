"""A step of generalized-alpha, by Newton's method with exact derivatives: see the stepper.

From y_n, and y'_n that it remembers, a step of length h solves

    y'_{n+am} = f(t + af h, y_{n+af})
    y'_{n+am} = y'_n + am (y'_{n+1} - y'_n),      y_{n+af} = y_n + af (y_{n+1} - y_n)
    y_{n+1} = y_n + h (y'_n + gamma (y'_{n+1} - y'_n))

for d = y_{n+af} - y_n.
"""

import math

from ab_sim.compiling.kinds import Table, call
from ab_sim.events.run import ImplicitWork, Run

KEPT = 6
"""Iterations of Newton's that a Jacobian serves."""
MOST = 60
"""Iterations after which a step is given up as not to be solved: its result is then not finite."""
CLOSE, SETTLED = 1e-14, 1e-7
"""Shares of what a step changes: corrections as small as the first end the iteration; those below
the second, once they no longer shrink: they are rounding."""


def implicit_step(own: ImplicitWork, run: Run, begin: float, length: float) -> None:
    """One step from the state, whose slope is known, into ``trial``; local time [s]."""
    am, af, gamma = own.mass, own.force, own.newmark
    state, past, d, at = run.state, run.work.memory[0], own.change, own.at
    equations, states = own.equations, run.state.size
    c, b = run.scene.c, run.balls.branches
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
    own.time[0] = begin + af * length
    before, solved = math.inf, False
    for k in range(MOST):
        for j in range(states):
            at[j] = state[j] + d[j]
        call(own.slope, c, b, at, own.slope_there, own.time[0])
        if k % KEPT == 0:
            differentiate(own, run)
        for i in range(states):
            for j in range(states):
                equations[i, j] = -reach * own.jacobian[i, j]
            equations[i, i] += 1.0
            equations[i, states] = reach * own.slope_there[i] + kept * past[i] - d[i]
        reduce(equations, states)
        balls = run.balls.first_angle
        change = max(share_changed(own, reach, 0, balls), share_changed(own, reach, balls, states))
        for j in range(states):
            d[j] += equations[j, states]
        # At rounding, corrections no longer shrink.
        if change <= CLOSE or (change < SETTLED and change > 0.5 * before):
            solved = True
            break
        before = change
    if not solved:
        d[0] = math.nan
    for j in range(states):
        run.work.trial[j] = state[j] + d[j] / af
        past[j] = (d[j] / (af * length) - (1.0 - gamma) * past[j]) / gamma


def differentiate(own: ImplicitWork, run: Run) -> None:
    """The Jacobian at the state and time at hand."""
    states, lanes, first = run.state.size, own.along.shape[1], 0
    while first < states:
        for j in range(states + 1):
            for lane in range(lanes):
                own.along[j, lane] = 1.0 if j == first + lane else 0.0
        c, b = run.scene.c, run.balls.branches
        call(own.tangent, c, b, own.time, own.at, own.along, own.rates)
        for lane in range(min(lanes, states - first)):
            for i in range(states):
                own.jacobian[i, first + lane] = own.rates[i, lane]
        first += lanes


def share_changed(own: ImplicitWork, reach: float, first: int, end: int) -> float:
    """Of what the step does to the states from ``first`` to ``end``, what is being corrected.

    By the largest of them, for one that stays at zero by symmetry is nothing but rounding.
    """
    size, most, column = 0.0, 0.0, own.change.size
    for j in range(first, end):
        size = max(size, abs(own.change[j]) + abs(reach * own.slope_there[j]))
        most = max(most, abs(own.equations[j, column]))
    return most / size if size > 0.0 else most


def reduce(table: Table, size: int) -> None:
    """Gauss and Jordan's elimination with partial pivoting, in place.

    Args:
        table: the matrix, shape (size, size + 1), and the right-hand side in its last column, which
            holds the solution at the end.
        size: how many equations there are.
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
