"""The sections of a scene. All values in SI units; angles in rad, speeds in rad/s."""

import math
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from ab_sim.base.errors import visible
from ab_sim.scene.quantities import (
    Count,
    Inertia,
    Length,
    Number,
    PerBall,
    Section,
    Vector,
    quantity,
)

MAX_BALLS = 64

Mass = Annotated[Number, Field(ge=1e-12, le=1e3)]
Radius = Annotated[Number, Field(gt=0, le=10)]
Angle = Annotated[Number, Field(ge=-1e10, le=1e10)]
Point = tuple[Length, Length, Length]
Stiffness = Annotated[Number, Field(ge=0, le=1e12)]
Damping = Annotated[Number, Field(ge=0, le=1e9)]


def _shown(text: str) -> str:
    """Refuse control characters, which terminals execute and pictures cannot show."""
    if visible(text) != text:
        raise ValueError("must contain no control characters; remove them")
    return text


def _one_line(text: str) -> str:
    if "\n" in text or "\t" in text:
        raise ValueError("must be one line")
    return _shown(text)


Words = Annotated[str, AfterValidator(_shown)]
OneLine = Annotated[str, AfterValidator(_one_line)]


class Rotor(Section):
    """The parts that move on the suspension, and their unbalance (docs/equations.md, 1)."""

    total_mass: Number | None = quantity(
        "M, all mass on the suspension, with the balls (give this or mass)",
        "kg",
        ge=1e-9,
        le=1e3,
        default=None,
    )
    mass: Number | None = quantity(
        "M - n m, all mass on the suspension without the balls (give this or total_mass)",
        "kg",
        ge=1e-9,
        le=1e3,
        default=None,
    )
    eccentricity: Number = quantity(
        "e, distance of the eccentric mass's centre from the shaft axis", "m", ge=0, le=1.0
    )
    eccentric_mass: Number | None = quantity(
        "M0, the eccentric mass; default: M - n m, all mass without the balls",
        "kg",
        ge=1e-9,
        le=1e3,
        default=None,
    )

    height: Length = quantity(
        "height of the rotor's mass centre along the shaft; only with a deck in space",
        "m",
        default=0.0,
    )
    inertia: Inertia | None = quantity(
        "inertia of rotor and disc about their mass centre, the first axis through the "
        "unbalance: [xx, yy, zz] or [xx, yy, zz, xy, xz, yz]; xz and yz are a couple "
        "unbalance; only with a deck in space",
        "kg m^2",
        default=None,
    )


class Deck(Section):
    """The deck as a rigid body in space, without rotor and balls.

    Its mass is the mass on the suspension less `rotor.eccentric_mass` and the balls.

    Deck axes x, y, z lie at C, the point of the spindle axis from which heights count; z is the
    spindle axis.
    """

    center: Point = quantity("centre of mass from C, on deck axes", "m", default=(0.0, 0.0, 0.0))
    inertia: Inertia = quantity(
        "inertia about the centre of mass, on deck axes: [xx, yy, zz] or [xx, yy, zz, xy, xz, "
        "yz]; xy is minus the integral of x y dm",
        "kg m^2",
    )


class Mount(Section):
    """A rubber mount between deck and housing: springs and dampers along three axes."""

    position: Point = quantity("position of the mount from C, on deck axes", "m")
    stiffness: PerBall[Stiffness] = quantity(
        "stiffness along the mount's axes: one number for all, or three", "N/m"
    )
    damping: PerBall[Damping] = quantity(
        "damping along the mount's axes: one number for all, or three", "N s/m"
    )
    turned: Vector = quantity(
        "rotation vector from the ground's axes to the mount's", "rad", default=(0.0, 0.0, 0.0)
    )


class Race(Section):
    """The ring in which the balls run, concentric with the shaft; or several rings of one size."""

    radius: Number = quantity("R, radius of the circle of the balls' centres", "m", gt=0, le=10)
    height: PerBall[Length] = quantity(
        "height of the race's plane along the shaft, one number or one per race; only with a "
        "deck in space",
        "m",
        default=0.0,
    )

    @property
    def heights(self) -> tuple[float, ...]:
        """Return the height of each race [m]."""
        return self.height if isinstance(self.height, tuple) else (self.height,)


class Balls(Section):
    """The balls, all equal or each with its own mass and radius."""

    count: Count = quantity("n, number of balls", "1", ge=0, le=MAX_BALLS)
    mass: PerBall[Mass] | None = quantity(
        "m, mass of a ball: one number for all, or a list with one per ball", "kg", default=None
    )
    radius: PerBall[Radius] | None = quantity(
        "a, radius of a ball: one number for all, or a list with one per ball; required by "
        "some effects, and to report overlapping balls",
        "m",
        default=None,
    )

    race: PerBall[Count] = quantity(
        "number of a ball's race, counted from 0: one number for all, or one per ball",
        "1",
        default=0,
    )

    @property
    def races(self) -> tuple[int, ...]:
        """Return the number of each ball's race, counted from 0."""
        return self.race if isinstance(self.race, tuple) else (self.race,) * self.count

    @property
    def masses(self) -> tuple[float, ...]:
        """Return each ball's mass [kg]; NaN if missing, which a checked scene does not have."""
        return self._each(self.mass)

    @property
    def radii(self) -> tuple[float, ...]:
        """Return each ball's radius [m]; NaN if missing."""
        return self._each(self.radius)

    @property
    def total_mass(self) -> float:
        """Return the mass of all balls [kg]."""
        if self.mass is None or isinstance(self.mass, tuple):
            return math.fsum(self.masses)
        return self.count * self.mass  # rounded once, like the sum of different masses

    def _each(self, value: float | tuple[float, ...] | None) -> tuple[float, ...]:
        if isinstance(value, tuple):
            return value
        return (math.nan if value is None else value,) * self.count


class StartDeck(Section):
    """Start state of the deck."""

    position: tuple[Length, ...] | None = quantity(
        "x, y from the position at rest; for a deck in space X, Y, Z of C from its position "
        "with relaxed mounts; default: at rest under gravity",
        "m",
        default=None,
    )
    velocity: tuple[Number, ...] | None = quantity(
        "rates of change of the position; default 0", "m/s", default=None
    )
    tilt: Vector | None = quantity(
        "alpha, beta, gamma of a deck in space: rotation by gamma about Z, then by alpha "
        "about the new x, then by beta about the newest y; default: at rest under gravity",
        "rad",
        default=None,
    )
    tilt_rate: Vector | None = quantity(
        "rates of change of the tilt angles; default 0", "rad/s", default=None
    )


class Start(Section):
    """The state at t = 0; by default deck and balls are at rest."""

    speed: Number = quantity("spindle speed", "rad/s", ge=-1e5, le=1e5, default=0.0)
    angle: Angle = quantity(
        "psi, the spindle's angle: direction of the unbalance in space", "rad", default=0.0
    )
    ball_angles: tuple[Angle, ...] | None = quantity(
        "theta, each ball's angle from the unbalance; default: the golden angle, 2.4 rad, "
        "from ball to ball, so that equal balls separate; with ball_contact a packed row "
        "around 0",
        "rad",
        default=None,
    )
    ball_rates: tuple[Number, ...] | None = quantity(
        "theta', each ball's speed relative to the race; default all 0", "rad/s", default=None
    )
    motor_integral: Number = quantity(
        "z, integral of the motor's speed loop", "rad", ge=-1e10, le=1e10, default=0.0
    )
    deck: StartDeck = StartDeck()


class Spindle(Section):
    """Limits of the speed servo that follows live commands."""

    max_speed: Number = quantity(
        "largest magnitude of a commanded speed; a larger command is rejected",
        "rad/s",
        gt=0,
        le=1e5,
    )
    max_acceleration: Number = quantity(
        "largest acceleration with which the servo changes the speed", "rad/s^2", gt=0, le=1e6
    )


class Solver(Section):
    """The integrator and its fixed step."""

    stepper: str = Field(
        default="auto",
        description="name of a registered stepper, or auto to choose one for the scene",
    )
    step: Number = quantity(
        "integration step, a whole number of nanoseconds", "s", gt=0, le=1.0, default=1e-3
    )

    parameters: dict[str, Number] = Field(
        default_factory=dict,
        description="parameters of the stepper by name; not allowed with auto",
    )

    @model_validator(mode="after")
    def _whole_nanoseconds(self) -> "Solver":
        # Message stamps count steps in integer nanoseconds.
        if round(self.step * 1e9) < 1 or abs(self.step * 1e9 - round(self.step * 1e9)) > 1e-6:
            raise ValueError(
                f"step = {self.step!r} s must be a whole number of nanoseconds, "
                "because stamps are counted in steps; e.g. 0.001"
            )
        return self


class Accuracy(Section):
    """Largest allowed error of a run; given instead of a solver."""

    angle: Number | None = quantity(
        "largest allowed error of a ball's angle from the unbalance",
        "rad",
        gt=0,
        le=10.0,
        default=None,
    )
    whirl: Number | None = quantity(
        "largest allowed error of the deck's displacement, in eccentricities e; in race radii "
        "if e = 0",
        "1",
        gt=0,
        le=1e6,
        default=None,
    )

    @model_validator(mode="after")
    def _something(self) -> "Accuracy":
        if self.angle is None and self.whirl is None:
            raise ValueError("give angle [rad] or whirl [e], or both; e.g. {angle: 1.0e-9}")
        return self


class Balanced(Section):
    """Criterion of the metric `balanced`; it does not act on the motion."""

    residual_unbalance: Number = quantity(
        "largest residual unbalance of a balanced run, as a fraction of M0 e, over the last "
        "tenth of the run",
        "1",
        gt=0,
        le=1e6,
        default=0.1,
    )
    residual_couple: Number | None = quantity(
        "largest residual couple of a balanced run, as a fraction of the rotor's couple; "
        "without this key, or without a couple, it does not count",
        "1",
        gt=0,
        le=1e6,
        default=None,
    )


def inertia_matrix(inertia: Inertia) -> np.ndarray:
    """Return an ``Inertia`` as a matrix [kg m^2], shape (3, 3)."""
    xx, yy, zz, xy, xz, yz = (*inertia, 0.0, 0.0, 0.0)[:6]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
