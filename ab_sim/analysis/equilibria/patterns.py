"""Closed forms of unbalanced resting states: balls in line with the displacement.

With z = u1 + i u2 = W exp(i phi), S the sum of m_i R over the balls on the side of the
displacement less those opposite, and D = k + k_3 W^2 - M w^2 + i c w, a deck at rest on the
rotating axes has D z = w^2 (M0 e + S exp(i phi)), so that

    G(W) = (Re D W - w^2 S)^2 + (c w W)^2 - w^4 (M0 e)^2 = 0,      phi = -arg(D W - w^2 S)

where W > 0. A negative radius in the three-ball paper is the pattern with S reversed. Equations
(14)-(24) of that paper give the roots for three equal balls and k_3 = 0, where G is quadratic;
relative-stability (15)-(22) gives them for two balls. With k_3, G is of the sixth degree in W.
"""

import itertools
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ab_sim.analysis.equilibria.resting import ClosedFormRotor
from ab_sim.base.errors import SceneError
from ab_sim.drive.balance import BALANCED

MOST_PATTERNS = 4096
"""Largest number of sign patterns; it allows 12 balls that all differ."""


class Pattern(NamedTuple):
    """Assignment of balls to the side of the displacement or opposite."""

    label: str
    """Label: p+q for equal balls, otherwise one sign per ball."""
    signs: tuple[int, ...]
    """Sign of each ball: 1 on the side of the displacement, -1 opposite."""
    moment: float
    """Pattern moment S [kg m]."""
    assignments: int
    """Number of ways to assign the balls to the places."""


def patterns_of(rotor: ClosedFormRotor) -> list[Pattern]:
    """Return all distinct patterns, those with more balls on the displacement's side first.

    Raises:
        SceneError: there are more than ``MOST_PATTERNS``.
    """
    kinds = [[i for i, k in enumerate(rotor.kinds) if k == kind] for kind in sorted({*rotor.kinds})]
    count = math.prod(len(kind) + 1 for kind in kinds)
    if count > MOST_PATTERNS:
        raise SceneError(
            f"balls.mass: {len(rotor.kinds)} balls of {len(kinds)} kinds can rest in {count} "
            f"patterns; at most {MOST_PATTERNS} are allowed; give more of the balls the same mass "
            "and radius, or use fewer balls"
        )
    return [
        _pattern(rotor, kinds, chosen)
        for chosen in itertools.product(*(range(len(kind), -1, -1) for kind in kinds))
    ]


def _pattern(rotor: ClosedFormRotor, kinds: list[list[int]], chosen: tuple[int, ...]) -> Pattern:
    signs = [-1] * len(rotor.kinds)
    for kind, count in zip(kinds, chosen, strict=True):
        for i in kind[:count]:
            signs[i] = 1
    if len(kinds) == 1:
        label = f"{chosen[0]}+{len(signs) - chosen[0]}"
    else:
        label = "".join("-+"[s > 0] for s in signs)
    moment = math.fsum(s * x for s, x in zip(signs, rotor.moments, strict=True))
    ways = math.prod(math.comb(len(k), c) for k, c in zip(kinds, chosen, strict=True))
    return Pattern(label or "no balls", tuple(signs), moment, ways)


def radii(rotor: ClosedFormRotor, moment: float, speed: float) -> list[float]:
    """Return the positive roots W of G [m], the largest first.

    Args:
        rotor: parameters of the closed forms.
        moment: pattern moment S [kg m].
        speed: spindle speed w [rad/s].
    """
    w2 = speed * speed
    if w2 == 0.0 or (moment == 0.0 and rotor.unbalance == 0.0):
        return []
    if abs(abs(moment) - rotor.unbalance) <= BALANCED * rotor.unbalance:
        moment = math.copysign(rotor.unbalance, moment)
    roots = _linear_radii(rotor, moment, speed) if rotor.cubic_stiffness == 0.0 else None
    if roots is None:
        roots = list(_polished(rotor, moment, speed))
    return sorted((W for W in roots if W > 0.0 and math.isfinite(W)), reverse=True)


def _linear_radii(rotor: ClosedFormRotor, moment: float, speed: float) -> list[float]:
    """Return the roots without a cubic spring, avoiding cancellation.

    They solve |D|^2 W^2 - 2 Re D w^2 S W + w^4 (S^2 - (M0 e)^2) = 0.
    """
    w2, real = speed * speed, rotor.stiffness - rotor.mass * speed * speed
    square = real * real + (rotor.damping * speed) ** 2
    half = real * moment
    rest = (moment - rotor.unbalance) * (moment + rotor.unbalance)
    under = square * rotor.unbalance**2 - (rotor.damping * speed * moment) ** 2
    if under < 0.0:
        return []
    far = half + math.copysign(math.sqrt(under), half)
    one = [w2 * far / square] if square > 0.0 else []
    two = [w2 * rest / far] if far != 0.0 else []
    return [*{*one, *two}]


def _polished(rotor: ClosedFormRotor, moment: float, speed: float) -> Iterator[float]:
    """Yield the roots for a cubic spring: companion-matrix roots, refined by Newton's method."""
    w2 = speed * speed
    size = w2 * (abs(moment) + rotor.unbalance)
    real, loss = rotor.stiffness - rotor.mass * w2, rotor.damping * speed
    # Scale W = x length by the smallest length at which a single term balances ``size``.
    length = (size / rotor.cubic_stiffness) ** (1.0 / 3.0)
    if real or loss:
        length = min(length, size / math.hypot(real, loss))
    a, b, s = rotor.cubic_stiffness * length**3 / size, real * length / size, w2 * moment / size
    d, e = loss * length / size, w2 * rotor.unbalance / size
    whole = [a * a, 0.0, 2.0 * a * b, -2.0 * a * s, b * b + d * d, -2.0 * b * s, (s - e) * (s + e)]
    taken: list[float] = []
    roots = np.asarray(np.roots(whole), complex)
    for x in roots.real[(roots.real > 0.0) & (np.abs(roots.imag) <= 1e-4 * np.abs(roots))].tolist():
        for _ in range(50):
            value, slope = _factored(a, b, s, d, e, x)
            if slope == 0.0:
                break
            step = value / slope
            x -= step
            if abs(step) <= 2e-16 * abs(x):
                break
        terms = (abs(s) + abs(b) * x + a * x * x * x) ** 2 + (d * x) ** 2 + e * e
        duplicate = any(abs(x - y) <= 1e-12 * x for y in taken) or (abs(s) == e and x < BALANCED)
        if x > 0.0 and abs(_factored(a, b, s, d, e, x)[0]) <= 1e-13 * terms and not duplicate:
            taken.append(x)
            yield x * length


def _factored(a: float, b: float, s: float, d: float, e: float, x: float) -> tuple[float, float]:
    """Return G and its derivative; factored differences of squares keep small roots accurate."""
    bare = (a * x * x + b) * x
    value = bare * (bare - 2.0 * s) + (s - e) * (s + e) + (d * x) ** 2
    return value, 2.0 * (bare - s) * (3.0 * a * x * x + b) + 2.0 * d * d * x


def phase(rotor: ClosedFormRotor, moment: float, speed: float, W: float) -> float:
    """Return the phase phi of the displacement [rad]."""
    w2 = speed * speed
    real = (rotor.stiffness + rotor.cubic_stiffness * W * W - rotor.mass * w2) * W - w2 * moment
    return math.atan2(-rotor.damping * speed * W, real)
