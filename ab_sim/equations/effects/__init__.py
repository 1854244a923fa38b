"""The effects a scene may call for: one file each, registered by importing it here.

An effect is a ``NamedTuple``: its fields are its parameters, its docstring its meaning, and it
has the methods, of those below, that it needs. What no effect of a scene does is not computed.
docs/contributing.md says what else an effect, and a new method in this list (a hook), needs.
Methods are formulas: plain Python on numbers, which are floats, arrays with one for each ball, or
expressions of ``ab_sim.tracing``, of which machine code is made; ``self`` is the effect.

What a method may do: compute its result from its arguments and the effect's fields, with + - * /,
whole powers, abs, comparisons, and ``cos``, ``sin``, ``sqrt`` and ``where`` of ``ab_sim.tracing``.
It keeps no state, makes no arrays, and raises nothing; the same arguments give the same result.
Where a number decides, it writes ``where(condition, a, b)``: an ``if`` on a traced number is an
error that says so. Fields that are not floats, as a count or a choice, may decide by ``if`` what is
computed. Steppers take results as smooth: a kink that no event locates costs accuracy.

    deck_force(self, deck) -> (f1, f2)
        force on the deck [N], rotating axes in and out; for what is equal in every direction
    space_force(self, deck) -> (fx, fy)
        force on the deck [N], axes fixed in space
    gravity(self) -> (gx, gy)
        acceleration of gravity across the shaft [m/s^2], axes fixed in space; for a deck in the
        plane
    weight(self) -> (gx, gy, gz)
        all of it, for a deck in space
    mount_stiffening(self, square) -> N/m
        stiffness that a mount gains when it is moved, by the square of how far [m^2]
    mount_energy(self, square) -> J
        energy that it stores for that
    ball_inertia(self, ball) -> kg
        inertia that a ball's motion along the race has beyond its mass, from its spin
    ball_drag(self, ball) -> N s/m
        force against a ball's speed along the race, per that speed
    friction_coefficient(self, ball) -> 1
        largest friction along the race per normal force of the race on the ball
    restitution(self, approach) -> 1
        speed at which two balls part per speed at which they have met [m/s]
    race_shape(self, c, s) -> (m, m, m, m)
        race at outward normal (c, s): h - R, x (along the tangent), l - R, dl/dtheta; see race.py
    race_arc(self, theta) -> m
        length along the race, less R theta; differences count
    spindle_acceleration(self, acceleration) -> rad/s^2
        how much of the spindle's acceleration the bodies feel
    rotor_moment(self) -> kg m^2, loop_torque(self, error, integral) -> N m,
    integral_rate(self, error, excess) -> rad/s, largest_torque(self) -> N m,
    back_torque(self, speed) -> N m
        a motor: inertia of the rotor, torque that the speed loop asks for, rate of the loop's
        integral, the torque's limit, and what is lost of it
    deck_energy(self, deck) -> J, space_energy(self, deck) -> J
        energy stored, for deck_force and space_force
    deck_loss(self, deck) -> W, space_loss(self, deck) -> W
        power dissipated
    check_scene(self, scene)
        raises ValueError for a scene in which the effect makes no sense

``register`` adds the equation, its source, and whether the balls' radius matters.
"""

from ab_sim.equations.effects.ball_contact import BallContact
from ab_sim.equations.effects.ball_spin import BallSpin
from ab_sim.equations.effects.gravity import Gravity
from ab_sim.equations.effects.hardening_suspension import HardeningSuspension
from ab_sim.equations.effects.motor import Motor
from ab_sim.equations.effects.race_friction import RaceFriction
from ab_sim.equations.effects.race_runout import RaceRunout
from ab_sim.equations.effects.rolling_friction import RollingFriction
from ab_sim.equations.effects.spindle_acceleration import SpindleAcceleration
from ab_sim.equations.effects.suspension import Suspension
from ab_sim.equations.effects.unequal_suspension import UnequalSuspension
from ab_sim.equations.effects.viscous_drag import ViscousDrag

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
