"""Order of balls along the race, distances of balls in contact, and start angles of balls.

All distances are lengths along the race, of the curve of the balls' centres: the law of contact
uses them (``events.balls.gap``), because their rates are exactly the balls' path speeds, so that no
impact and no row creates energy. Two balls touch at the distance that holds on a round race of
radius R,

    s_j - s_i = D = 2 R asin((a_i + a_j) / (2 R)),

where the chord is a_i + a_j. On an oval that chord belongs to an arc that is longer than D by about
(a_i + a_j)^3 (1/l^2 - 1/R^2) / 24 where l is the radius of curvature: by at most 2e-4 of D for the
thesis' balls at lobe = R/50, and by 2 % at R/4, the largest lobe. Contact is detected too late by
this amount where l < R, too early where l > R.
"""

import math
from collections.abc import Sequence
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ab_sim.scene.model import Scene


def _race_length(
    radius: float, behind: float, ahead: float, arc_behind: float, arc_ahead: float
) -> float:
    """Return the length of the race between two angles [m].

    Parameters
    ----------
    radius
        R [m].
    behind, ahead
        The angles [rad], unwrapped.
    arc_behind, arc_ahead
        ``race_arc`` of the scene's effects at these angles [m].
    """
    return radius * (ahead - behind) + (arc_ahead - arc_behind)


def contacts_of(scene: "Scene") -> np.ndarray:
    """Return ``System.contacts``: a row for each ball and the next one along the race.

    A row has the number of the ball, and the distance at which the two touch, along the race [m].
    There are no rows if balls may pass each other.
    """
    if "ball_contact" not in scene.effects:
        return np.zeros((0, 2))
    rows = [(i, scene.race.radius * _apart(scene, i, j)) for i, j, _ in _neighbours(scene)]
    return np.array(rows, dtype=float).reshape(-1, 2)


APART = math.pi * (3.0 - math.sqrt(5.0))
"""Golden angle [rad] between default start angles. With it, no two of any number of balls start at
one angle, and the balls do not balance each other at the start."""


def start_angles(scene: "Scene") -> tuple[float, ...]:
    """Return the balls' start angles [rad]: those of the scene, or the default.

    By default balls are the golden angle apart; with ball_contact they form a packed row around 0.
    """
    if scene.start.ball_angles is not None:
        return scene.start.ball_angles
    if "ball_contact" not in scene.effects:
        return tuple(reduced(APART * ball)[0] for ball in range(scene.balls.count))
    places = [0.0] * min(scene.balls.count, 1)
    for i in range(1, scene.balls.count):
        places.append(places[-1] + _apart(scene, i - 1, i))
    return tuple(_angle_at(scene, place - 0.5 * places[-1]) for place in places)


def equal_pairs(scene: "Scene") -> list[tuple[int, int]]:
    """Return pairs of equal balls in one race and with equal rates at the start."""
    balls = scene.balls
    rates = scene.start.ball_rates or (0.0,) * balls.count
    sizes = [None if math.isnan(radius) else radius for radius in balls.radii]
    kinds = list(zip(balls.masses, sizes, balls.races, rates, strict=True))
    return [(i, j) for i, j in combinations(range(balls.count), 2) if kinds[i] == kinds[j]]


def at_one_angle(one: float, other: float) -> bool:
    """Return whether two angles [rad] differ by whole turns, up to rounding."""
    return abs(math.remainder(one - other, 2.0 * math.pi)) < 1e-9


def never_part(scene: "Scene") -> list[tuple[int, int]]:
    """Return pairs of equal balls that start at one angle and therefore stay together."""
    angles = start_angles(scene)
    return [(i, j) for i, j in equal_pairs(scene) if at_one_angle(angles[i], angles[j])]


def angles_at_random(scene: "Scene", shares: Sequence[float]) -> tuple[float, ...]:
    """Return random start angles of balls on the race, without overlaps [rad].

    With ball_contact, the first ball may be anywhere. The others are drawn as points on the length
    that the balls leave free, and the sizes are inserted afterwards. So all arrangements of equal
    balls have the same probability. For unequal balls, all orders have the same probability; that
    differs from equal probability of all arrangements by terms of third order in the radius.

    Parameters
    ----------
    scene
        Scene; its start angles are ignored.
    shares
        Random numbers in [0, 1), one for each ball.

    Returns
    -------
    tuple[float, ...]
        Angles from -pi to pi; balls overlap if there is not enough room.
    """
    start = 2 * math.pi * shares[0] - math.pi if shares else 0.0
    if "ball_contact" not in scene.effects or len(shares) < 2:
        return tuple(2 * math.pi * share - math.pi for share in shares)
    ring = [0, *sorted(range(1, len(shares)), key=lambda i: shares[i])]
    room = [_apart(scene, i, j) for i, j in zip(ring, [*ring[1:], 0], strict=True)]
    free = max(2 * math.pi - math.fsum(room), 0.0)
    angles = [0.0] * len(shares)
    for place, ball in enumerate(ring):
        ahead = free * shares[ball] + math.fsum(room[:place]) if place else 0.0
        angles[ball] = reduced(_angle_at(scene, start + ahead))[0]
    return tuple(angles)


def check_row(scene: "Scene") -> None:
    """Refuse balls that do not fit on the race, or that overlap at the start.

    Raises
    ------
    ValueError
        The message names the value that is too large, or two balls and their overlap.
    """
    n, R = scene.balls.count, scene.race.radius
    if n < 2:
        return
    if max(scene.balls.radii) >= R / 2:
        raise ValueError(
            f"balls.radius = {max(scene.balls.radii):g} m: with ball_contact it must be less than "
            f"half of race.radius = {R:g} m"
        )
    if "race_runout" in scene.effects:
        # Lengths are undefined along a race that is not convex.
        scene.effects["race_runout"].check_scene(scene)
    # An oval is as long as the round race: the contributions of the lobes cancel.
    room, length = R * sum(_apart(scene, i, j) for i, j, _ in _neighbours(scene)), 2 * math.pi * R
    if n > 2 and room >= length * (1 - 1e-9):
        raise ValueError(
            f"balls.count = {n}: with ball_contact the balls need {room:.4g} m of the race's "
            f"{length:.4g} m, and some room to move; use fewer or smaller balls"
        )
    for i, j, apart in _neighbours(scene):
        need = R * _apart(scene, i, j)
        if apart < need * (1 - 1e-9):
            raise ValueError(
                f"start.ball_angles: balls {i} and {j} overlap at the start, {apart:.6g} m apart "
                f"along the race; with ball_contact they need {need:.6g} m between their centres "
                f"({need / R:.6g} rad of a round race); leave the angles out to start in a packed "
                "row, or move the balls apart"
            )


def start_gaps(scene: "Scene", contacts: int) -> list[float]:
    """Return the gaps between balls at the first ``contacts`` contacts at the start [m]."""
    if not contacts:
        return []
    return [
        apart - scene.race.radius * _apart(scene, i, j)
        for i, j, apart in _neighbours(scene)[:contacts]
    ]


def reduced(angle: Any) -> tuple[Any, Any]:
    """Return an angle, or a column of angles, as (angle within -pi .. pi, whole turns).

    An angle in that range is returned unchanged. Up to 1e15 rad, turns are exact, and the angle is
    off by at most 5e-16 rad.
    """
    if isinstance(angle, np.ndarray):
        # One by one, because NumPy's sine may differ from the C library's in the last bit.
        within, turns = angle.copy(), np.zeros(angle.shape)
        for k in np.flatnonzero(np.abs(angle) > math.pi):
            within[k], turns[k] = reduced(float(angle[k]))
        return within, turns
    if abs(angle) <= math.pi:
        return angle, 0.0
    # The C library reduces the argument with as many digits of pi as necessary.
    rest = math.atan2(math.sin(angle), math.cos(angle))
    return rest, float(round((angle - rest) / (2 * math.pi)))


def _neighbours(scene: "Scene") -> list[tuple[int, int, float]]:
    """Return pairs of neighbouring balls, with the centres' distance along the race [m]."""
    angles = [reduced(angle)[0] for angle in start_angles(scene)]
    order = sorted(range(len(angles)), key=lambda i: (angles[i], i))
    pairs = []
    for i, j in zip(order, [*order[1:], *order[:1]], strict=True):
        turn = (angles[j] - angles[i]) % (2 * math.pi)
        # An angle that is below 2 pi by a rounding error only counts as 0.
        turn = 0.0 if 2 * math.pi - turn < 1e-9 else turn
        pairs.append((i, j, _length(scene, angles[i], angles[i] + turn)))
    return pairs


def _length(scene: "Scene", behind: float, ahead: float) -> float:
    """Return the length of a scene's race between two angles [rad], see ``_race_length`` [m]."""
    return _race_length(
        scene.race.radius, behind, ahead, _race_arc(scene, behind), _race_arc(scene, ahead)
    )


def _angle_at(scene: "Scene", place: float) -> float:
    """Return the angle [rad] that is reached after a length of R * ``place`` from angle 0."""
    R, angle = scene.race.radius, place
    # Fixed-point iteration. The length's derivative by the angle is between R/4 and 7/4 R, as
    # lobes are at most R/4, so each iteration reduces the error to at most three quarters.
    for _ in range(200):
        before, angle = angle, angle + place - _length(scene, 0.0, angle) / R
        if angle == before:
            break
    return angle


def _race_arc(scene: "Scene", angle: float) -> float:
    """Return ``race_arc``, summed over the scene's effects [m]."""
    effects = scene.effects.values()
    return sum(effect.race_arc(angle) for effect in effects if hasattr(effect, "race_arc"))


def _apart(scene: "Scene", i: int, j: int) -> float:
    """Return the distance along the race of balls i and j in contact, in radii R of the race."""
    a, b = scene.balls.radii[i], scene.balls.radii[j]
    return 2 * math.asin((a + b) / (2 * scene.race.radius))
