"""Effects that a scene may name, registered by importing them here.

An effect is a ``NamedTuple``. Its fields are its parameters, its docstring is its meaning, and it
has those of the methods below that it needs. A method that no effect of a scene has is not
computed. docs/contributing.md lists the other requirements of an effect, and of a new method in
this list (a hook). Methods are formulas: plain Python on numbers, which are floats, arrays with one
for each ball, or expressions of ``ab_sim.tracing``, from which machine code is generated; ``self``
is the effect.

A method computes its result from its arguments and the effect's fields, with + - * /, integer
powers, abs, comparisons, and ``cos``, ``sin``, ``sqrt`` and ``where`` of ``ab_sim.tracing``. It
keeps no state, creates no arrays, and raises nothing; the same arguments give the same result. A
choice by a number is written ``where(condition, a, b)``; an ``if`` on a traced number raises an
error that explains this. Fields that are not floats, such as counts and choices, may be tested with
``if``. Steppers rely on smooth results: a kink that is not located as an event costs accuracy.

    deck_force(self, deck) -> (f1, f2)
        force on the deck [N], arguments and result on rotating axes; for isotropic laws
    space_force(self, deck) -> (fx, fy)
        force on the deck [N], axes fixed in space
    gravity(self) -> (gx, gy)
        acceleration of gravity across the shaft [m/s^2], axes fixed in space; for a deck in the
        plane
    weight(self) -> (gx, gy, gz)
        acceleration of gravity [m/s^2], axes fixed in space; for a deck in space
    mount_stiffening(self, square) -> N/m
        stiffness that a mount gains by a displacement, from the displacement's square [m^2]
    mount_energy(self, square) -> J
        energy stored in a mount by this stiffness
    ball_inertia(self, ball) -> kg
        inertia of a ball along the race in addition to its mass, from its spin
    ball_drag(self, ball) -> N s/m
        force against a ball's speed along the race, per that speed
    friction_coefficient(self, ball) -> 1
        largest friction along the race per normal force of the race on the ball
    restitution(self, approach) -> 1
        separation speed of two balls divided by their approach speed [m/s]
    race_shape(self, c, s) -> (m, m, m, m)
        race at outward normal (c, s): h - R, x (along the tangent), l - R, dl/dtheta; see race.py
    race_arc(self, theta) -> m
        length along the race up to theta, less R theta; only differences matter
    spindle_acceleration(self, acceleration) -> rad/s^2
        part of the spindle's acceleration that acts on the bodies
    rotor_moment(self) -> kg m^2, loop_torque(self, error, integral) -> N m,
    integral_rate(self, error, excess) -> rad/s, largest_torque(self) -> N m,
    back_torque(self, speed) -> N m
        a motor: inertia of the rotor, torque that the speed loop commands, rate of the loop's
        integral, limit of the torque, and loss of torque
    deck_energy(self, deck) -> J, space_energy(self, deck) -> J
        energy stored, for deck_force and space_force
    deck_loss(self, deck) -> W, space_loss(self, deck) -> W
        power dissipated
    check_scene(self, scene)
        raises ValueError for a scene to which the effect does not apply

``register`` adds the equation, its source, and whether the balls' radius matters.
"""

from ab_sim.model.equations.effects.built_in import (
    BallContact,
    BallSpin,
    Gravity,
    HardeningSuspension,
    Motor,
    RaceFriction,
    RaceRunout,
    RollingFriction,
    SpindleAcceleration,
    Suspension,
    UnequalSuspension,
    ViscousDrag,
)

__all__ = [
    "BallContact",
    "BallSpin",
    "Gravity",
    "HardeningSuspension",
    "Motor",
    "RaceFriction",
    "RaceRunout",
    "RollingFriction",
    "SpindleAcceleration",
    "Suspension",
    "UnequalSuspension",
    "ViscousDrag",
]
