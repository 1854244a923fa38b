"""Closed forms of unbalanced resting states: balls in line with the displacement.

With z = u1 + i u2 = W exp(i phi), S the sum of m_i R over the balls on the side of the
displacement less those opposite, and D = k + k_3 W^2 - M w^2 + i c w, a deck at rest on the
rotating axes has D z = w^2 (M0 e + S exp(i phi)), so that

    G(W) = (Re D W - w^2 S)^2 + (c w W)^2 - w^4 (M0 e)^2 = 0,      phi = -arg(D W - w^2 S)

where W > 0. A negative radius in the three-ball paper is the pattern with S reversed. Equations
(14)-(24) of that paper give the roots for three equal balls and k_3 = 0, where G is quadratic;
relative-stability (15)-(22) gives them for two balls. With k_3, G is of the sixth degree in W.

Folds are the speeds at which two states of a pattern meet and end. All states of a pattern at all
speeds w > 0 lie on one curve over their phase phi, -pi < phi < 0. From the imaginary part of D z =
w^2 (M0 e + S exp(i phi)), W = g w with g = -M0 e sin(phi) / c, and the real part leaves

    h(phi, w) = g (k_3 g^2 - M) w^2 - (S + M0 e cos(phi)) w + k g = 0.

At a fold dh/dphi = 0 as well. As h is quadratic in w, the search covers the whole curve, its lower
and its upper part, so that detached branches are found too. Without a cubic spring, folds are at (k
- M w^2)^2 (M0 e)^2 = c^2 w^2 (S^2 - (M0 e)^2), which is (16) = 0 of the three-ball paper for three
equal balls.
"""

import itertools
import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq

from ab_sim.analysis.equilibria.resting import ClosedFormRotor
from ab_sim.base.errors import SceneError
from ab_sim.drive.closed_forms import BALANCED

_MOST_PATTERNS = 4096
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

    Raises
    ------
    SceneError
        There are more than ``_MOST_PATTERNS``.
    """
    kinds = [[i for i, k in enumerate(rotor.kinds) if k == kind] for kind in sorted({*rotor.kinds})]
    count = math.prod(len(kind) + 1 for kind in kinds)
    if count > _MOST_PATTERNS:
        raise SceneError(
            f"balls.mass: {len(rotor.kinds)} balls of {len(kinds)} kinds can rest in {count} "
            f"patterns; at most {_MOST_PATTERNS} are allowed; give more of the balls the same mass "
            "and radius, or use fewer balls"
        )
    return [
        _pattern(rotor, kinds, chosen)
        for chosen in itertools.product(*(range(len(kind), -1, -1) for kind in kinds))
    ]


def _pattern(rotor: ClosedFormRotor, kinds: list[list[int]], chosen: tuple[int, ...]) -> Pattern:
    """Return the pattern with ``chosen`` balls of each kind on the displacement's side.

    Parameters
    ----------
    rotor
        Closed-form parameters.
    kinds
        Indices of the balls of each kind.
    chosen
        Number of balls of each kind.
    """
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

    Parameters
    ----------
    rotor
        Parameters of the closed forms.
    moment
        Pattern moment S [kg m].
    speed
        Spindle speed w [rad/s].
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
    discriminant = square * rotor.unbalance**2 - (rotor.damping * speed * moment) ** 2
    if discriminant < 0.0:
        return []
    # The root whose terms have equal signs comes first; the other follows from their product.
    far = half + math.copysign(math.sqrt(discriminant), half)
    first = [w2 * far / square] if square > 0.0 else []
    second = [w2 * rest / far] if far != 0.0 else []
    return [*{*first, *second}]


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
    # Near a fold rounding makes a double root complex: keep roots with a small imaginary part.
    # Newton's method and the residual then decide which of them exist.
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
    """Return G and its derivative at the scaled radius x; see ``_polished`` for the coefficients.

    Differences of squares are factored, which keeps small roots accurate.
    """
    bare = (a * x * x + b) * x
    value = bare * (bare - 2.0 * s) + (s - e) * (s + e) + (d * x) ** 2
    return value, 2.0 * (bare - s) * (3.0 * a * x * x + b) + 2.0 * d * d * x


def phase(rotor: ClosedFormRotor, moment: float, speed: float, W: float) -> float:
    """Return the phase phi of the displacement from the unbalance [rad].

    Parameters
    ----------
    rotor
        Parameters of the closed forms.
    moment
        Pattern moment S [kg m].
    speed
        Spindle speed w [rad/s].
    W
        Radius, a root of G [m].
    """
    w2 = speed * speed
    real = (rotor.stiffness + rotor.cubic_stiffness * W * W - rotor.mass * w2) * W - w2 * moment
    return math.atan2(-rotor.damping * speed * W, real)


_TANGENTS = np.geomspace(1e-9, 1e9, 6001)
"""Grid of tan(-phi/2) on which sign changes of dh/dphi are sought."""


class Fold(NamedTuple):
    """Speed and radius at which two states of a pattern meet."""

    speed: float
    """Speed w > 0 [rad/s]."""
    W: float
    """Radius W [m]."""
    kind: str
    """Change of the pair of states with rising speed: ``appear`` or ``vanish``."""


def folds_of(rotor: ClosedFormRotor, moment: float) -> list[Fold]:
    """Return all folds of a pattern with S = ``moment`` [kg m], by rising speed."""
    if rotor.unbalance == 0.0 or rotor.damping == 0.0:
        return []
    return sorted(_linear(rotor, moment) if not rotor.cubic_stiffness else _cubic(rotor, moment))


def _linear(rotor: ClosedFormRotor, moment: float) -> Iterator[Fold]:
    """Yield the fold without a cubic spring, if there is one.

    It is the root w^2 with W > 0: the lower one for S > 0, the higher one for S < 0.
    """
    excess = (abs(moment) - rotor.unbalance) * (abs(moment) + rotor.unbalance)
    if excess <= 0.0:
        return
    natural = rotor.stiffness / rotor.mass
    half = (rotor.damping / rotor.mass) ** 2 * excess / (2.0 * rotor.unbalance**2)
    high = natural + half + math.sqrt(half * (half + 2.0 * natural))
    square = high if moment < 0.0 else natural / high * natural
    if square > 0.0:
        real = rotor.stiffness - rotor.mass * square
        W = square * real * moment / (real * real + rotor.damping**2 * square)
        yield Fold(math.sqrt(square), W, "appear" if moment < 0.0 else "vanish")


class _Curve(NamedTuple):
    """Coefficients of h(phi, w), a polynomial in w, and of its derivatives with respect to phi."""

    mass: float
    """Mass M / (M0 e) [1/m]."""
    stiffness: float
    """Stiffness k / (M0 e) [1/(m s^2)]."""
    cubic: float
    """Cubic stiffness k_3 / (M0 e) [1/(m^3 s^2)]."""
    moment: float
    """Pattern moment S / (M0 e)."""
    length: float
    """Length M0 e / c [m s], so that g = -``length`` sin(phi)."""

    def at(self, tangent: Any) -> tuple[Any, Any, Any]:
        """Return h, dh/dphi and d^2 h/dphi^2, divided by M0 e, at ``tangent`` = tan(-phi/2).

        Each is a polynomial in w: the coefficients of w^2, w and 1.
        """
        cos, sin = (1.0 - tangent**2) / (1.0 + tangent**2), 2.0 * tangent / (1.0 + tangent**2)
        g, gp = self.length * sin, -self.length * cos
        k3, M, k = self.cubic, self.mass, self.stiffness
        value = g * (k3 * g * g - M), -(self.moment + cos), k * g
        slope = gp * (3.0 * k3 * g * g - M), -sin, k * gp
        curve = 6.0 * k3 * g * gp * gp - g * (3.0 * k3 * g * g - M), cos, -k * g
        return value, slope, curve

    def speeds(self, tangent: Any) -> np.ndarray:
        """Return the lower and the upper w > 0 on the curve [rad/s], NaN if missing.

        Parameters
        ----------
        tangent
            Values of tan(-phi/2), any shape.

        Returns
        -------
        np.ndarray
            Speeds, shape (2, ...).
        """
        a, b, c = self.at(np.asarray(tangent))[0]
        with np.errstate(all="ignore"):
            q = -0.5 * (b + np.copysign(np.sqrt(b * b - 4.0 * a * c), b))
            squares = np.array([q / a, c / q])
        return np.sort(np.where((squares > 0.0) & np.isfinite(squares), squares, np.nan), axis=0)

    def tilt(self, tangent: Any, w: Any) -> Any:
        """Return dh/dphi / (M0 e) at tan(-phi/2) and w [rad/s]; it is 0 at a fold."""
        return np.polyval(self.at(tangent)[1], w)

    def fold_near(self, tangent: float, w: float) -> tuple[float, float] | None:
        """Return tan(-phi/2) and w of the fold near a guess; None if Newton's method fails.

        The equations are h = 0 and dh/dphi = 0.
        """
        for _ in range(60):
            value, slope, bend = self.at(tangent)
            by_w = np.array([2.0 * value[0] * w + value[1], 2.0 * slope[0] * w + slope[1]])
            # Newton's variables are log tan(-phi/2) and log w, both of which stay positive. The
            # derivative of the first by phi is -1 / sin(-phi).
            by_log = -2.0 * tangent / (1.0 + tangent**2)
            jacobian = np.array([[by_log * np.polyval(slope, w), w * by_w[0]],
                                 [by_log * np.polyval(bend, w), w * by_w[1]]])  # fmt: skip
            residual = np.array([np.polyval(value, w), np.polyval(slope, w)])
            if not np.isfinite(jacobian).all() or np.linalg.matrix_rank(jacobian) < 2:
                return None
            step = np.linalg.solve(jacobian, residual)
            step *= min(1.0, 0.3 / max(float(np.abs(step).max()), 1e-300))
            tangent, w = tangent * math.exp(-step[0]), w * math.exp(-step[1])
            if np.abs(step).max() < 1e-13:
                return tangent, w
        return None


def _cubic(rotor: ClosedFormRotor, moment: float) -> Iterator[Fold]:
    """Yield the folds with a cubic spring, in any order."""
    per = 1.0 / rotor.unbalance
    curve = _Curve(
        rotor.mass * per,
        rotor.stiffness * per,
        rotor.cubic_stiffness * per,
        moment * per,
        rotor.unbalance / rotor.damping,
    )
    for tangent, w in _folds_on(curve):
        value, _, bend = curve.at(tangent)
        rise = 2.0 * value[0] * w + value[1]
        # Along the curve d^2 w / dphi^2 = -(d^2 h / dphi^2) / (dh / dw). If it is positive, w is
        # smallest at the fold, and two states appear with rising speed.
        kind = "appear" if np.polyval(bend, w) * rise < 0.0 else "vanish"
        yield Fold(w, curve.length * 2.0 * tangent / (1.0 + tangent**2) * w, kind)


def _folds_on(curve: _Curve) -> Iterator[tuple[float, float]]:
    """Yield tan(-phi/2) and w [rad/s] of each fold."""
    speeds = curve.speeds(_TANGENTS)
    signs = np.sign(curve.tilt(_TANGENTS, speeds))
    for part in (0, 1):
        for k in np.flatnonzero(signs[part, :-1] * signs[part, 1:] < 0.0):

            def tilt(log_tangent: float, part: int = part) -> float:
                tangent = math.exp(log_tangent)
                return float(curve.tilt(tangent, curve.speeds(tangent)[part]))

            ends = math.log(_TANGENTS[k]), math.log(_TANGENTS[k + 1])
            tangent = math.exp(brentq(tilt, *ends, xtol=1e-15, rtol=1e-15))
            yield tangent, float(curve.speeds(tangent)[part])
    # Folds where the two parts meet: between the last points with two speeds and the next ones.
    both = np.isfinite(speeds).all(axis=0)
    for k in np.flatnonzero(both & (signs[0] * signs[1] < 0.0)):
        if not both[max(k - 1, 0)] or not both[min(k + 1, len(_TANGENTS) - 1)]:
            guess = float(_TANGENTS[k]), float(np.sqrt(speeds[0, k] * speeds[1, k]))
            fold = curve.fold_near(*guess)
            if fold is not None:
                yield fold
