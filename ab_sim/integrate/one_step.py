"""One step of a stepper, between events: from the state to the trial state."""

from typing import Any

import numba
from numba.extending import overload

from ab_sim.dynamics.dispatch import INLINED, effect_class
from ab_sim.dynamics.numbers.multiply_add import multiply_add
from ab_sim.dynamics.planar import derivatives
from ab_sim.integrate.on_stack import scratch_of, state_size, trial_of
from ab_sim.integrate.sweeps import sweep_step
from ab_sim.integrate.tableau import Weights


def one_step(
    weights: Any,
    system: Any,
    place: Any,
    begin: float,
    length: float,
    state: Any,
    modes: Any,
    work: Any,
) -> None:
    """Take one step of ``length`` [s] from ``begin``, local time [s].

    ``work.slopes[0]`` holds the slope at the start; the result is put into ``work.trial``.
    """
    raise TypeError(f"no stepper has the weights {type(weights)}")


@overload(one_step, jit_options=INLINED, strict=False)
def _one_step(weights, system, place, begin, length, state, modes, work):  # type: ignore[no-untyped-def]
    body = explicit_step if effect_class(weights) is Weights else sweep_step
    return lambda weights, system, place, begin, length, state, modes, work: body(
        weights, system, place, begin, length, state, modes, work
    )


inlined_derivatives = numba.njit(**INLINED)(derivatives.py_func)
"""``derivatives`` for where nearly all of the time is spent."""


@numba.njit(**INLINED)
def explicit_step(weights, system, place, begin, length, state, modes, work):  # type: ignore[no-untyped-def]
    """An explicit Runge-Kutta step."""
    slopes, trial, scratch = work.slopes, trial_of(system, work), scratch_of(system, work)
    stages, states = weights.b.size, state_size(system, state)
    for stage in range(1, stages):
        for j in range(states):
            trial[j] = 0.0
        for earlier in range(stage):
            weight = weights.a[stage, earlier]
            if weight != 0.0:
                for j in range(states):
                    trial[j] = multiply_add(weight, slopes[earlier, j], trial[j])
        for j in range(states):
            trial[j] = multiply_add(length, trial[j], state[j])
        time = begin + weights.c[stage] * length
        inlined_derivatives(system, place, time, trial, modes, slopes[stage], scratch)
    for j in range(states):
        trial[j] = 0.0
    for stage in range(stages):
        for j in range(states):
            trial[j] = multiply_add(weights.b[stage], slopes[stage, j], trial[j])
    for j in range(states):
        work.trial[j] = multiply_add(length, trial[j], state[j])
