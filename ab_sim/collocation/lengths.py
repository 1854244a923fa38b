"""How long the next collocation step is, in parts of the scene's steps."""

import math

from ab_sim.collocation.run import LENGTH, MOVED, WAIT, CollocationRun, head_of
from ab_sim.compiling.kinds import Floats, Integers
from ab_sim.integrate.steppers.collocation import PARTS

FIRST_TURN = 0.5
"""How far the spindle turns at most in a first step, or the deck goes in its cycle, or what drag
makes of a jump decays [rad]: no estimate by later coefficients sees what is over before the first
node."""
FARTHEST_TURN = math.pi / 4.0
"""How far the spindle turns at most in a step, for each node [rad]: eight nodes see no more than
one turn of a wave, and what they miss of it is not in the coefficients that they find."""
NEAR = 0.05
"""A step's error is so near to what is asked for that none longer will do, see ``power_of``."""
PATIENCE = 16.0
"""Steps after one that was not taken before a longer one is tried again."""


def turns_too_far(own: CollocationRun, length: float) -> bool:
    """Whether the spindle turns too far in a step [s] if it goes on as it has."""
    head, count = head_of(own), own.method.nodes.at.size
    turn = abs(head[MOVED]) * (length / head[LENGTH])
    return own.method.steps < 1.0 and turn > FARTHEST_TURN * count


def longer(counts: Integers, size: int) -> int:
    """The next of a step's lengths, in parts: of the counts of samples, or of their halves."""
    if size < PARTS:
        return 2 * size
    for k in range(counts.size):
        if counts[k] * PARTS > size:
            return counts[k] * PARTS
    return 2 * size


def shorter(counts: Integers, size: int) -> int:
    """The one before."""
    below = size // 2
    for k in range(counts.size):
        if below < counts[k] * PARTS < size:
            below = counts[k] * PARTS
    return below


def power_of(own: CollocationRun, ratio: float) -> float:
    """What a step's error is multiplied with where its length is with this ratio.

    Two powers more than there are nodes.
    """
    square, found = ratio * ratio, 1.0
    for _ in range((own.method.nodes.at.size + 2) // 2):
        found *= square
    return found


def after_refusal(own: CollocationRun, size: int, error: float) -> int:
    """How long a step is tried after one that was not taken."""
    less = shorter(own.method.nodes.counts, size)
    if error * power_of(own, less / size) <= own.method.tolerance:
        return less
    half = size // 2
    return PARTS if PARTS < half < 2 * PARTS else half


def next_size(own: CollocationRun, head: Floats, size: int, error: float, within: float) -> int:
    """How long the next step is, after one without a kink behind it, in parts."""
    method, counts = own.method, own.method.nodes.counts
    if method.steps >= 1.0:
        next_one = longer(counts, size)
        return next_one if next_one <= method.steps * PARTS else size
    if head[WAIT] > 0.0:
        head[WAIT] -= 1.0
        return size
    # A longer one has a sample within it if it is longer than a step of the scene.
    most = error if size < PARTS else max(error, within)
    if most > NEAR * method.tolerance:
        return size
    for _ in range(2):
        more = longer(counts, size)
        most *= power_of(own, more / size)
        if more > most_samples(counts) * PARTS or not most < method.tolerance:
            break
        size = more
    return size


def most_samples(counts: Integers) -> int:
    """In a step."""
    return counts[counts.size - 1]


def first_size(own: CollocationRun, length: float, speed: float) -> int:
    """How long the first step behind a kink is, in parts.

    Args:
        own: the Collocation.
        length: of a step of the scene [s].
        speed: of the spindle [rad/s].
    """
    rate, sides, counts = abs(speed), own.sides, own.method.nodes.counts
    for q in range(sides):
        rate = max(rate, max(own.linear[q], math.sqrt(own.linear[sides + q])))
    size, steps = most_samples(counts) * PARTS, own.method.steps
    most = steps if steps >= 1.0 else float(most_samples(counts))
    while size > 1 and (size * (length / PARTS) * rate > FIRST_TURN or size > most * PARTS):
        size = shorter(counts, size)
    return size
