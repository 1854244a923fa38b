"""A ball on the race: where it is, and what acts along the race: docs/equations.md, 1 and 6.

The ball's centre lies at h n + x t from the shaft, n and t being the race's outward normal and
tangent there; l is the race's radius of curvature. A round race on the shaft's axis has h = l = R
and x = 0. Path speed s' = l theta' and path acceleration s'' = l theta'' + (dl/dtheta) theta'^2.
"""

from typing import Any, NamedTuple

from ab_sim.equations.motion import Ball
from ab_sim.equations.sums import Number, any_has, over_effects


class BallConstants(NamedTuple):
    """Constants of the balls; each a number per ball, but for the first."""

    number: int
    """How many."""
    mass: Number
    """m [kg]."""
    radius: Number
    """a [m]."""
    rolling_mass: Number
    """mu = m + I/a^2 [kg], I = 0 where balls do not roll."""
    mobility: Number
    """1/mu; 0 of a ball that is stuck to the race."""
    moment: Number
    """m R [kg m]."""
    lever: Number
    """m R - I/a [kg m]: mass that couples the spindle's acceleration with the path acceleration, on
    a round race."""
    race_radius: Number
    """R [m], of the circle of the ball's centre."""
    race_curvature: Number
    """1/R."""
    height: Number
    """Of its race along the shaft [m]."""

    @property
    def each(self) -> Ball:
        """As effects see them."""
        return Ball(self.mass, self.radius)


class OnRace(NamedTuple):
    """Where the balls are; each a number per ball."""

    c: Number
    s: Number
    """(c, s) is n, on the rotor's axes."""
    h: Number
    x: Number
    """The ball's place from the shaft along n and along t [m]; x = dh/dtheta."""
    mh: Number
    mx: Number
    """m times that [kg m]."""
    lever: Number
    """m h - I/a [kg m]: as of ``BallConstants``, on this race."""
    curve: Number
    """l [m]."""
    curvature: Number
    """1/l."""
    dl_dtheta: Number
    """[m]."""
    rate: Number
    """theta' [rad/s]."""
    path: Number
    """s' [m/s]."""


def on_race(effects: Any, balls: BallConstants, c: Number, s: Number, rate: Number) -> OnRace:
    """Where the balls are, from cosine, sine and rate of their angles."""
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
    """The ball's inertial force, -m times its acceleration [N].

    Returns:
        Along n and along t, without what the deck's, the spindle's and the path acceleration add:
        m (h w^2 + 2 w s' + l theta'^2) and m x w^2.
    """
    if not any_has(effects, "race_shape"):
        return balls.moment * (w + on.rate) * (w + on.rate), 0.0
    m = balls.mass
    return m * (w * w * on.h + (2.0 * w + on.rate) * on.path), m * on.x * w * w


def drag_force(effects: Any, balls: BallConstants, on: OnRace) -> Number:
    """Of the race on the ball, along it [N]."""
    return -(over_effects(effects, "ball_drag", 0.0, balls.each) * on.path)


def friction_coefficient(effects: Any, balls: BallConstants) -> Number:
    """Largest friction along the race per normal force."""
    return over_effects(effects, "friction_coefficient", 0.0, balls.each)


def rate_change(on: OnRace, path_acceleration: Number) -> Number:
    """theta'' [rad/s^2] from s'' [m/s^2]."""
    return (path_acceleration - on.dl_dtheta * on.rate * on.rate) * on.curvature


def path_acceleration(on: OnRace, rate_change: Number) -> Number:
    """s'' [m/s^2] from theta'' [rad/s^2]."""
    return on.curve * rate_change + on.dl_dtheta * on.rate * on.rate


def path_length(effects: Any, balls: BallConstants, theta: Number) -> Number:
    """Length along the race [m]; only differences count."""
    return balls.race_radius * theta + over_effects(effects, "race_arc", 0.0, theta)
