"""The effects a scene may call for: one file each, registered by importing it here.

An effect is a ``NamedTuple``: its fields are its parameters, its docstring its meaning, and it
has the methods, of those below, that it needs. A method that no effect of a scene has is not in
that scene's kernel. Methods are plain Python, compiled by numba; ``self`` is the effect.

    deck_force(self, body, deck) -> (f1, f2)
        force on the deck on the rotating axes [N]
    ball_inertia(self, ball) -> kg
        inertia that the ball's tangential motion has beyond its mass
    ball_force(self, body, ball, motion, deck) -> N
        force on a ball along the race, in the direction of growing theta
    friction_coefficient(self, ball) -> 1
        friction along the race per normal force of the race on the ball
    spindle_acceleration(self, acceleration) -> rad/s^2
        how much of the spindle's acceleration the bodies feel
    motor_torque(self, body, ball, motion, deck, reaction) -> N m
        what the spindle motor has to supply for one ball's sake
    deck_energy(self, deck) -> J, ball_energy(self, body, ball, motion, deck) -> J
        energy stored
    deck_loss(self, deck) -> W, ball_loss(self, body, ball, motion, reaction) -> W
        power dissipated

``register`` adds the equation, its source, and whether the balls' radius matters.
"""

from ab_sim.dynamics.effects.ball_spin import BallSpin
from ab_sim.dynamics.effects.rolling_friction import RollingFriction
from ab_sim.dynamics.effects.spindle_acceleration import SpindleAcceleration
from ab_sim.dynamics.effects.suspension import Suspension
from ab_sim.dynamics.effects.viscous_drag import ViscousDrag

__all__ = ["BallSpin", "RollingFriction", "SpindleAcceleration", "Suspension", "ViscousDrag"]
