"""Balls of a size in their order along the race: how much room they need, and where they start."""

import math

import numpy as np

from ab_sim.scene.model import Scene


def contacts_of(scene: Scene) -> np.ndarray:
    """``System.contacts``: the row of balls of a scene whose balls cannot pass each other."""
    if "ball_contact" not in scene.effects:
        return np.zeros((0, 2))
    rows = [(i, scene.race.radius * _apart(scene, i, j)) for i, j, _ in _neighbours(scene)]
    return np.array(rows, dtype=float).reshape(-1, 2)


def start_angles(scene: Scene) -> tuple[float, ...]:
    """Where the balls start [rad]: as the scene says, else at 0, or packed in a row around 0."""
    if scene.start.ball_angles is not None:
        return scene.start.ball_angles
    if "ball_contact" not in scene.effects:
        return (0.0,) * scene.balls.count
    places = [0.0]
    for i in range(1, scene.balls.count):
        places.append(places[-1] + _apart(scene, i - 1, i))
    return tuple(place - 0.5 * places[-1] for place in places)


def check_row(scene: Scene) -> None:
    """Refuse balls that do not fit on the race, or that overlap at the start.

    Raises:
        ValueError: names what is too large, or which two balls overlap and how far to move them.
    """
    n, R = scene.balls.count, scene.race.radius
    if n < 2:
        return
    if max(scene.balls.radii) >= R / 2:
        raise ValueError(
            f"balls.radius = {max(scene.balls.radii):g} m: with ball_contact it must be less than "
            f"half of race.radius = {R:g} m"
        )
    room = sum(_apart(scene, i, j) for i, j, _ in _neighbours(scene))
    if n > 2 and room >= 2 * math.pi * (1 - 1e-9):
        raise ValueError(
            f"balls.count = {n}: with ball_contact the balls need {room:.4g} rad of the race's "
            f"{2 * math.pi:.4g} rad, and some room to move; use fewer or smaller balls"
        )
    for i, j, gap in _neighbours(scene):
        need = _apart(scene, i, j)
        # A ball at 2 pi less a rounding error is one at 0.
        gap = 0.0 if 2 * math.pi - gap < 1e-9 else gap
        if min(gap, 2 * math.pi - gap if n == 2 else gap) < need * (1 - 1e-9):
            raise ValueError(
                f"start.ball_angles: balls {i} and {j} overlap at the start, {gap:.6g} rad apart; "
                f"with ball_contact they need {need:.6g} rad between their centres; leave the "
                "angles out to start in a packed row, or move the balls apart"
            )


def reduced(angle: float) -> tuple[float, float]:
    """An angle as (angle within -pi .. pi, whole turns).

    One that is within is returned as it is. Of a larger one, up to 1e15 rad, turns are exact, and
    the angle within is off by at most 5e-16 rad.
    """
    if abs(angle) <= math.pi:
        return angle, 0.0
    # The C library reduces with as many digits of pi as it takes.
    within = math.atan2(math.sin(angle), math.cos(angle))
    return within, float(round((angle - within) / (2 * math.pi)))


def _neighbours(scene: Scene) -> list[tuple[int, int, float]]:
    """Each ball, the next one along the race, and the angle from one to the other [rad]."""
    angles = [reduced(angle)[0] for angle in start_angles(scene)]
    order = sorted(range(len(angles)), key=lambda i: (angles[i], i))
    pairs = zip(order, [*order[1:], *order[:1]], strict=True)
    return [(i, j, (angles[j] - angles[i]) % (2 * math.pi)) for i, j in pairs]


def _apart(scene: Scene, i: int, j: int) -> float:
    """Angle between the centres of balls i and j in contact [rad]."""
    a, b = scene.balls.radii[i], scene.balls.radii[j]
    return 2 * math.asin((a + b) / (2 * scene.race.radius))
