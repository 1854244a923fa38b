"""Parameters of the reference simulator of the deck in space: plain numbers in SI units.

C is the point of the spindle's axis in the deck's reference plane. Ground axes XYZ have their
origin at C while the springs are relaxed. Deck axes xyz start at C, z along the spindle, and are
parallel to XYZ at rest. Disc axes turn with the spindle, by psi about z; ball angles phi count from
the first disc axis, unwrapped.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from .params import Contact, Friction, Motor, Runout, Spindle
from .plant import Array

Vector = Sequence[float] | Array
Matrix = Sequence[Sequence[float]] | Array


@dataclass(frozen=True)
class Body:
    """Rigid body: centre of mass on deck axes, inertia about the centre of mass on these axes.

    A product of inertia is minus the integral of x y dm.
    """

    mass: float
    com: Vector = (0.0, 0.0, 0.0)
    inertia: Matrix = ((0.0,) * 3,) * 3


@dataclass(frozen=True)
class Disc:
    """Disc and rotor: all parts that turn with the spindle, except the balls.

    Its centre of mass is at ``eccentricity`` in the direction ``angle`` of the disc axes, at
    ``height``; ``inertia`` is about it, on the disc axes (not turned by ``angle``): a product of
    inertia is a couple unbalance. ``points`` are further masses (mass, position on disc axes).
    """

    mass: float
    height: float = 0.0
    eccentricity: float = 0.0
    angle: float = 0.0
    inertia: Matrix = ((0.0,) * 3,) * 3
    points: tuple[tuple[float, Vector], ...] = ()

    @property
    def com(self) -> Array:
        """Return the centre of mass on the disc axes, without the points [m]."""
        e, a = self.eccentricity, self.angle
        return np.array([e * np.cos(a), e * np.sin(a), self.height])


@dataclass(frozen=True)
class Ball:
    """Ball that rolls without slip if it has an inertia, and is a point mass otherwise.

    Its spin is psi' - s'/a about the spindle's axis relative to the deck, with s' its speed along
    the race, R phi' on a round one.
    """

    mass: float
    radius: float = 0.0
    inertia: float = 0.0


@dataclass(frozen=True)
class Race:
    """Circle of ball centres at a height.

    ``drag`` is D: the moment -D phi' acts on each ball, and its opposite on the disc. On an uneven
    race it is the force -(D / R^2) s'.
    """

    radius: float
    balls: tuple[Ball, ...] = ()
    height: float = 0.0
    drag: float = 0.0
    runout: Runout = field(default_factory=Runout)


@dataclass(frozen=True)
class Mount:
    """Springs and dampers between ground and a point of the deck, relaxed at rest.

    f = -A (k * A^T u + c * A^T u') - cubic |u|^2 u on ground axes, u the point's displacement and
    the columns of A = ``axes`` the mount's three axes.
    """

    position: Vector
    stiffness: Vector
    damping: Vector = (0.0, 0.0, 0.0)
    axes: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    cubic: float = 0.0


@dataclass(frozen=True)
class DeckParams:
    """Deck on mounts, with disc and balls.

    A motor's torque acts between deck and rotor, and ``motor.inertia`` is that of a flywheel on the
    spindle's axis, in addition to the disc's inertia. Friction and contact apply to all races.
    """

    deck: Body
    disc: Disc
    races: tuple[Race, ...] = ()
    mounts: tuple[Mount, ...] = ()
    gravity: Vector = (0.0, 0.0, 0.0)
    spindle: Spindle = field(default_factory=Spindle)
    motor: Motor | None = None
    friction: Friction = field(default_factory=Friction)
    contact: Contact | None = None

    def __post_init__(self) -> None:
        rolling = any(ball.inertia for ball in self.balls) or self.friction.arm
        if (rolling or self.contact is not None) and not all(b.radius > 0.0 for b in self.balls):
            raise ValueError("balls that roll, or that touch each other, need a radius")
        if self.motor is not None and not self.spindle.feel_acceleration:
            raise ValueError("with a motor, psi'' cannot be left out")

    @property
    def balls(self) -> tuple[Ball, ...]:
        """Return the balls of all races, in the order of the races."""
        return tuple(ball for race in self.races for ball in race.balls)

    def but(self, **changes: object) -> "DeckParams":
        """Return the parameters with some fields replaced."""
        return replace(self, **changes)  # type: ignore[arg-type]
