"""Balls on the race: position, and forces along the race: docs/equations.md, 1 and 6.

The ball's centre lies at h n + x t from the shaft, n and t being the race's outward normal and
tangent there; l is the race's radius of curvature. A round race on the shaft's axis has h = l = R
and x = 0. Path speed s' = l theta' and path acceleration s'' = l theta'' + (dl/dtheta) theta'^2.
"""

from typing import Any, NamedTuple

from ab_sim.model.equations.motion import Ball
from ab_sim.model.equations.sums import Number, any_has, over_effects


class BallConstants(NamedTuple):
    """Constants of the balls; each is a number per ball, except the first."""

    number: int
    """Number of balls."""
    mass: Number
    """Mass m [kg]."""
    radius: Number
    """Radius a [m]."""
    rolling_mass: Number
    """Rolling mass mu = m + I/a^2 [kg]; I = 0 for balls that do not roll."""
    mobility: Number
    """Mobility 1/mu; 0 for a ball that is held on the race."""
    moment: Number
    """Moment m R [kg m]."""
    lever: Number
    """Lever m R - I/a [kg m]: mass that couples the spindle's acceleration with the path
    acceleration on a round race."""
    race_radius: Number
    """Radius R of the circle of the ball's centre [m]."""
    race_curvature: Number
    """Curvature 1/R [1/m]."""
    height: Number
    """Height of the ball's race along the shaft [m]."""

    @property
    def each(self) -> Ball:
        """Masses and radii in the form that effects take."""
        return Ball(self.mass, self.radius)


class OnRace(NamedTuple):
    """Positions of the balls on the race; each is a number per ball."""

    c: Number
    s: Number
    """Outward normal n = (c, s), on the rotor's axes."""
    h: Number
    x: Number
    """Position of the ball from the shaft along n and along t [m]; x = dh/dtheta."""
    mh: Number
    mx: Number
    """Mass m times that position [kg m]."""
    lever: Number
    """Lever m h - I/a [kg m]: as in ``BallConstants``, on this race."""
    curve: Number
    """Radius of curvature l [m]."""
    curvature: Number
    """Curvature 1/l [1/m]."""
    dl_dtheta: Number
    """Derivative dl/dtheta [m]."""
    rate: Number
    """Rate theta' [rad/s]."""
    path: Number
    """Path speed s' [m/s]."""


def on_race(effects: Any, balls: BallConstants, c: Number, s: Number, rate: Number) -> OnRace:
    """Return the balls' positions on the race, from cosine, sine and rate of their angles."""
    R, m = balls.race_radius, balls.mass
    if not any_has(effects, "race_shape"):
        path = R * rate
        return OnRace(
            *(c, s, R, 0.0, balls.moment, 0.0, balls.lever),
            *(R, balls.race_curvature, 0.0, rate, path),
        )
    beyond, x, curve, dl_dtheta = over_effects(effects, "race_shape", (0.0,) * 4, c, s)
    h, curve = R + beyond, R + curve
    lever = balls.lever + m * beyond
    return OnRace(
        c, s, h, x, m * h, m * x, lever, curve, 1.0 / curve, dl_dtheta, rate, curve * rate
    )


def relative_load(
    effects: Any, balls: BallConstants, on: OnRace, w: Number
) -> tuple[Number, Number]:
    """Return the centrifugal and Coriolis force on each ball [N].

    The inertial forces due to accelerations of the deck, of the spindle (w') and along the path
    (s'') are not included. Symbols as in ``OnRace``.

    Returns:
        Components along n and t: m (h w^2 + 2 w s' + l theta'^2) and m x w^2.
    """
    if not any_has(effects, "race_shape"):
        return balls.moment * (w + on.rate) * (w + on.rate), 0.0
    m = balls.mass
    return m * (w * w * on.h + (2.0 * w + on.rate) * on.path), m * on.x * w * w


def drag_force(effects: Any, balls: BallConstants, on: OnRace) -> Number:
    """Return the drag of the race on the ball, along it [N]."""
    return -(over_effects(effects, "ball_drag", 0.0, balls.each) * on.path)


def friction_coefficient(effects: Any, balls: BallConstants) -> Number:
    """Return the largest friction along the race per normal force."""
    return over_effects(effects, "friction_coefficient", 0.0, balls.each)


def rate_change(on: OnRace, path_acceleration: Number) -> Number:
    """Return theta'' [rad/s^2] from s'' [m/s^2]."""
    return (path_acceleration - on.dl_dtheta * on.rate * on.rate) * on.curvature


def path_acceleration(on: OnRace, rate_change: Number) -> Number:
    """Return s'' [m/s^2] from theta'' [rad/s^2]."""
    return on.curve * rate_change + on.dl_dtheta * on.rate * on.rate


def path_length(effects: Any, balls: BallConstants, theta: Number) -> Number:
    """Return the length along the race up to an angle [m]; only differences have a meaning."""
    return balls.race_radius * theta + over_effects(effects, "race_arc", 0.0, theta)
