"""Generalized-alpha for first-order equations: implicit, with damping of what is fast by choice.

From y_n, and y'_n that it remembers, a step of length h solves

    y'_{n+am} = f(t + af h, y_{n+af})
    y'_{n+am} = y'_n + am (y'_{n+1} - y'_n),      y_{n+af} = y_n + af (y_{n+1} - y_n)
    y_{n+1} = y_n + h (y'_n + gamma (y'_{n+1} - y'_n))

with am = (3 - rho) / (2 (1 + rho)), af = 1 / (1 + rho), gamma = 1/2 + am - af: of order 2, stable
for any step, and what is infinitely fast is multiplied by -rho in each. What is unknown is
d = y_{n+af} - y_n.

Jansen, Whiting and Hulbert (2000), Comput. Methods Appl. Mech. Engrg. 190, 305-319; Chung and
Hulbert (1993), J. Appl. Mech. 60, is the second-order form that deck-3d used.
"""

import functools
from typing import Any, NamedTuple

import numba
import numpy as np

from ab_sim.dynamics.dispatch import APART
from ab_sim.dynamics.layout import angle_at
from ab_sim.dynamics.linear_solver import reduce
from ab_sim.dynamics.slope import evaluate
from ab_sim.integrate.jacobian import jacobian
from ab_sim.integrate.on_stack import own_array
from ab_sim.integrate.registry import Parameter, register_family
from ab_sim.integrate.stepper import Stepper

KEPT = 6
"""Iterations of Newton's that a Jacobian serves."""
MOST = 60
"""Iterations after which a step is given up as not to be solved: its result is then not finite."""
CLOSE, SETTLED = 1e-14, 1e-7
"""Shares of what a step changes: corrections as small as the first end the iteration; those below
the second, once they no longer shrink: they are rounding."""

ROUNDING = 1e-7
"""In the modulus of a root: two that are nearly equal are found to half of the digits."""


class Weights(NamedTuple):
    """What a step is made with."""

    mass: float
    """am, where between the ends y' is taken."""
    force: float
    """af, where f is."""
    newmark: float
    """gamma."""

    def step(self, plant: Any, begin: float, length: float, state: Any, work: Any) -> None:
        """See ``Stepper.weights``."""
        alpha_step(self, plant, begin, length, state, work)


def growth_of(weights: Weights, z: complex) -> complex:
    """What one step makes of y' = lambda y, z = step times lambda: its larger root.

    A step maps (y, h y'); of the two roots one follows y, and one is the method's own.
    """
    am, af, gamma = weights
    a = am - gamma * af * z
    b = 1.0 - 2.0 * am - (gamma * (1.0 - af) + (1.0 - gamma) * af) * z
    c = am - 1.0 - (1.0 - gamma) * (1.0 - af) * z
    largest = complex(max(np.roots([a, b, c]), key=abs))
    # With rho = 1 the method's own root is -1 for any z.
    return largest / abs(largest) if 1.0 < abs(largest) < 1.0 + ROUNDING else largest


RADIUS = Parameter(
    "share that a step leaves of what is infinitely fast: 0 takes it away at once, 1 keeps it",
    default=0.8,
    lowest=0.0,
    highest=1.0,
)


@register_family("generalized-alpha", {"rho_inf": RADIUS})
def generalized_alpha(rho_inf: float) -> Stepper:
    """The method that leaves ``rho_inf`` of what is infinitely fast in each step."""
    am, af = (3.0 - rho_inf) / (2.0 * (1.0 + rho_inf)), 1.0 / (1.0 + rho_inf)
    weights = Weights(am, af, 0.5 + am - af)
    return Stepper(
        "generalized-alpha",
        2,
        "Jansen, Whiting and Hulbert (2000), Comput. Methods Appl. Mech. Engrg. 190, 305-319",
        weights,
        evaluations=4,
        growth=functools.partial(growth_of, weights),
        slopes=3,
        memory=1,
        locates_events=False,
        priced=False,
    )


@numba.njit(**APART)
def share_changed(d, slope, correction, reach, first, end):  # type: ignore[no-untyped-def]
    """Of what the step does to the states from ``first`` to ``end``, what is being corrected.

    By the largest of them, for one that stays at zero by symmetry is nothing but rounding.
    """
    size = most = 0.0
    for j in range(first, end):
        size = max(size, abs(d[j]) + abs(reach * slope[j]))
        most = max(most, abs(correction[j]))
    return most / size if size > 0.0 else most


@numba.njit(**APART)
def alpha_step(weights, plant, begin, length, state, work):  # type: ignore[no-untyped-def]
    """One step of the method; see ``Stepper.weights``."""
    am, af, gamma = weights
    states, slope, at, past = state.size, work.slopes[1], work.slopes[2], work.memory[0]
    fresh = True
    for j in range(states):
        fresh = fresh and past[j] == 0.0
    if fresh:
        for j in range(states):
            past[j] = work.slopes[0, j]
    reach = af * gamma * length / am
    kept, time = length * af * (1.0 - gamma / am), begin + af * length
    matrix, table = own_array(0.0, (states, states)), own_array(0.0, (states, states + 1))
    d, balls = own_array(0.0, (states,)), angle_at(plant.system, 0)
    for j in range(states):
        d[j] = af * length * past[j]
    before = np.inf
    for k in range(MOST):
        for j in range(states):
            at[j] = state[j] + d[j]
        evaluate(plant, time, at, slope)
        if k % KEPT == 0:
            jacobian(plant, time, at, matrix)
        for i in range(states):
            for j in range(states):
                table[i, j] = -reach * matrix[i, j]
            table[i, i] += 1.0
            table[i, states] = reach * slope[i] + kept * past[i] - d[i]
        reduce(table, states, states + 1)
        change = max(
            share_changed(d, slope, table[:, states], reach, 0, balls),
            share_changed(d, slope, table[:, states], reach, balls, states),
        )
        for j in range(states):
            d[j] += table[j, states]
        # At rounding, corrections no longer shrink.
        if change <= CLOSE or (change < SETTLED and change > 0.5 * before):
            break
        before = change
    else:
        d[0] = np.nan
    for j in range(states):
        work.trial[j] = state[j] + d[j] / af
        past[j] = (d[j] / (af * length) - (1.0 - gamma) * past[j]) / gamma
