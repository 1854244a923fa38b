"""How long the next span of collocation is, in parts of the scene's steps."""

import math

import numba

from ab_sim.dynamics.dispatch import APART, INLINED
from ab_sim.dynamics.layout import equation_count
from ab_sim.dynamics.spindle_motion import spindle_motion
from ab_sim.integrate.hand_over import PARTS
from ab_sim.integrate.response_tables import COUNTS, SAMPLES, linear_part
from ab_sim.integrate.span import MOVED, SPAN, WAIT

FIRST_TURN = 0.5
"""How far the spindle turns at most in a first span, or the deck goes in its cycle, or what drag
makes of a jump decays [rad]: no estimate by later coefficients sees what is over before the first
node."""
FARTHEST_TURN = 2.0 * math.pi
"""How far the spindle turns at most in a span [rad]: eight nodes see no more of a wave, and what
they miss of it is not in the coefficients that they find."""
NEAR = 0.05
"""A span's error is so near to what is asked for that none longer will do, see ``power_of``."""
PATIENCE = 16.0
"""Spans after one that was not taken before a longer one is tried again."""


@numba.njit(**INLINED)
def turns_too_far(weights, head, length):  # type: ignore[no-untyped-def]
    """Whether the spindle turns too far in a span [s] if it goes on as it has."""
    turn = abs(head[MOVED]) * (length / head[SPAN])
    return weights.steps < 1.0 and turn > FARTHEST_TURN


@numba.njit(**INLINED)
def longer(size):  # type: ignore[no-untyped-def]
    """The next of a span's lengths, in parts of a step: of COUNTS, or of their halves."""
    if size < PARTS:
        return 2 * size
    for count in COUNTS:
        if count * PARTS > size:
            return count * PARTS
    return 2 * size


@numba.njit(**INLINED)
def shorter(size):  # type: ignore[no-untyped-def]
    """The one before."""
    below = size // 2
    for count in COUNTS:
        if below < count * PARTS < size:
            below = count * PARTS
    return below


@numba.njit(**INLINED)
def after_refusal(weights, size, error):  # type: ignore[no-untyped-def]
    """How long a span is tried after one that was not taken."""
    less = shorter(size)
    if error * power_of(less / size) <= weights.tolerance:
        return less
    half = size // 2
    return PARTS if PARTS < half < 2 * PARTS else half


@numba.njit(**INLINED)
def power_of(ratio):  # type: ignore[no-untyped-def]
    """What a span's error is multiplied with where its length is with this ratio."""
    square = ratio * ratio
    return square * square * square * square * square


@numba.njit(**INLINED)
def next_size(weights, head, size, error, within):  # type: ignore[no-untyped-def]
    """How long the next span is, after one without a kink behind it, in parts of a step."""
    if weights.steps >= 1.0:
        next_one = longer(size)
        return next_one if next_one <= weights.steps * PARTS else size
    if head[WAIT] > 0.0:
        head[WAIT] -= 1.0
        return size
    # A longer one has a sample within it if it is longer than a step.
    most = error if size < PARTS else max(error, within)
    if most > NEAR * weights.tolerance:
        return size
    for _ in range(2):
        more = longer(size)
        most *= power_of(more / size)
        if more > SAMPLES * PARTS or not most < weights.tolerance:
            break
        size = more
    return size


@numba.njit(**APART)
def first_size(weights, plant, begin, length, state, work):  # type: ignore[no-untyped-def]
    """How long the first span behind a kink is, in parts of a step."""
    system = plant.system
    rate = abs(spindle_motion(plant, begin, state).speed)
    for q in range(equation_count(system)):
        c, k = linear_part(system, work.tables, q)
        rate = max(rate, c, math.sqrt(k))
    size, most = SAMPLES * PARTS, weights.steps if weights.steps >= 1.0 else SAMPLES
    while size > 1 and (size * (length / PARTS) * rate > FIRST_TURN or size > most * PARTS):
        size = shorter(size)
    return size
