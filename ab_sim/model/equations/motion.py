"""Motion of the balls on the race, of deck and spindle; forces along the race, and motor torques.

The ball's centre lies at h n + x t from the shaft, n and t being the race's outward normal and
tangent there; l is the race's radius of curvature. A round race on the shaft's axis has h = l = R
and x = 0. Path speed s' = l theta' and path acceleration s'' = l theta'' + (dl/dtheta) theta'^2.
Symbols as in docs/equations.md, 1 and 6, in SI units; axis 1 of the rotating frame points at the
unbalance.
"""

from typing import Any, NamedTuple

from ab_sim.model.equations.sums import Number, any_has, over_effects
from ab_sim.tracing.functions import cos, sin, where


class Ball(NamedTuple):
    """Constants of one ball."""

    mass: float
    """Mass m [kg]."""
    radius: float
    """Radius a [m]; NaN in a scene whose effects do not use it."""


class DeckMotion(NamedTuple):
    """Motion of the deck, on rotating or on fixed axes, as stated at its use."""

    x: float
    y: float
    """Displacement from the unloaded suspension [m]."""
    vx: float
    vy: float
    """Inertial velocity [m/s]."""


class SpindleMotion(NamedTuple):
    """Motion of the spindle at one instant."""

    speed: float
    """Speed w [rad/s]."""
    acceleration: float
    """Acceleration al [rad/s^2]; 0 without the effect spindle_acceleration, and with a motor, whose
    equation of motion determines it."""
    cos: float
    sin: float
    """Cosine and sine of psi; 1 and 0 in a scene whose effects do not need them."""
    torque: float
    """Motor torque [N m]; 0 with a prescribed speed."""
    integral_rate: float
    """Rate of change of the speed loop's integral [rad/s]; 0 with a prescribed speed."""


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


BALL_COLUMNS = BallConstants._fields[1:]
"""Constants of each ball: columns of arrays, in this order."""


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
    """Return the balls' positions on the race from cosine, sine and rate of the ball angles."""
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

    Returns
    -------
    tuple[Number, Number]
        Components along n and t: m (h w^2 + 2 w s' + l theta'^2) and m x w^2.
    """
    if not any_has(effects, "race_shape"):
        return balls.moment * (w + on.rate) * (w + on.rate), 0.0
    m = balls.mass
    return m * (w * w * on.h + (2.0 * w + on.rate) * on.path), m * on.x * w * w


def drag_force(effects: Any, balls: BallConstants, on: OnRace) -> Number:
    """Return the drag force of the race on each ball, along the race [N]."""
    return -(over_effects(effects, "ball_drag", 0.0, balls.each) * on.path)


def friction_coefficient(effects: Any, balls: BallConstants) -> Number:
    """Return the largest friction force along the race, per normal force of the race [1]."""
    return over_effects(effects, "friction_coefficient", 0.0, balls.each)


def rate_change(on: OnRace, path_acceleration: Number) -> Number:
    """Return theta'' [rad/s^2] from s'' [m/s^2]."""
    return (path_acceleration - on.dl_dtheta * on.rate * on.rate) * on.curvature


def path_length(effects: Any, balls: BallConstants, theta: Number) -> Number:
    """Return the length along the race up to an angle [m]; only differences have a meaning."""
    return balls.race_radius * theta + over_effects(effects, "race_arc", 0.0, theta)


class ActiveSegment(NamedTuple):
    """Segment of the speed schedule that is in force, as numbers or expressions."""

    law: Any
    """Speed law, a function of the time since the segment's beginning: a ``Ramp``,
    ``RaisedCosine`` or ``RampAndCosine``."""
    phase: Number
    """Spindle angle at the segment's beginning [rad], without whole turns."""
    until: Number
    """Time from the segment's beginning to its end [s]."""
    angle: Number
    """Spindle angle at the segment's beginning [rad], with whole turns: for samples."""

    @property
    def numbers(self) -> list[Number]:
        """Return the numbers in the order of a kernel's constants: the speed law's come first."""
        return [*self.law, self.phase, self.until, self.angle]


class MotorState(NamedTuple):
    """State of a spindle that a motor drives."""

    psi: Number
    """Angle [rad]."""
    speed: Number
    """Speed w [rad/s]."""
    integral: Number
    """Integral of the speed loop [rad]."""
    limit: Number
    """Limit branch: 1 or -1 while the motor is at its torque limit in that direction, else 0."""


class Torques(NamedTuple):
    """Torques from which a motor's events are located."""

    commanded: Number
    """Torque commanded by the speed loop [N m]."""
    limit: Number
    """Largest torque of the motor [N m]."""


def prescribed(
    effects: Any, place: ActiveSegment, time: Number, angle_needed: bool
) -> SpindleMotion:
    """Return the motion of a spindle that follows the schedule exactly.

    Parameters
    ----------
    effects
        Effects of the scene.
    place
        Segment of the schedule.
    time
        Time since the segment's beginning [s].
    angle_needed
        True to compute cosine and sine of the angle; else they are 1 and 0.
    """
    acceleration = over_effects(effects, "spindle_acceleration", 0.0, place.law.acceleration(time))
    c, s = 1.0, 0.0
    if angle_needed:
        psi = place.phase + place.law.angle(time)
        c, s = cos(psi), sin(psi)
    return SpindleMotion(place.law.speed(time), acceleration, c, s, 0.0, 0.0)


def motor_driven(
    effects: Any, place: ActiveSegment, time: Number, at: MotorState, angle_needed: bool
) -> tuple[SpindleMotion, Torques]:
    """Return the motion of a spindle with a motor, and the torques from which events are located.

    The acceleration is 0 here, because the equations of motion determine it.

    Parameters
    ----------
    effects
        Effects of the scene.
    place
        Segment of the schedule, whose speed the motor's speed loop follows.
    time
        Time since the segment's beginning [s].
    at
        State of the spindle.
    angle_needed
        True to compute cosine and sine of the angle; else they are 1 and 0.
    """
    # At the limit, the branch decides and not a comparison of torques: the equations then stay
    # smooth beyond the event at which the torque leaves its limit, and the event can be located.
    error = place.law.speed(time) - at.speed
    commanded = over_effects(effects, "loop_torque", 0.0, error, at.integral)
    limit = over_effects(effects, "largest_torque", 0.0)
    delivered = where(abs(at.limit) > 0.5, at.limit * limit, commanded)
    rate = over_effects(effects, "integral_rate", 0.0, error, commanded - delivered)
    torque = delivered - over_effects(effects, "back_torque", 0.0, at.speed)
    c, s = (cos(at.psi), sin(at.psi)) if angle_needed else (1.0, 0.0)
    return SpindleMotion(at.speed, 0.0, c, s, torque, rate), Torques(commanded, limit)
