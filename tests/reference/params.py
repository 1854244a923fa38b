"""Parameters of the planar reference simulator: plain numbers in SI units, optional effects."""

from dataclasses import dataclass, field, replace


@dataclass(frozen=True)
class Suspension:
    """Springs and dampers between ground and deck.

    f = -K u - C u' - cubic |u|^2 u, with K = diag(k1, k2) and C = diag(c1, c2) on principal axes
    turned by ``axis_angle`` from the inertial x; u is measured from the *unloaded* suspension.
    """

    k1: float
    k2: float
    c1: float = 0.0
    c2: float = 0.0
    axis_angle: float = 0.0
    cubic: float = 0.0

    @classmethod
    def isotropic(cls, k: float, c: float = 0.0) -> "Suspension":
        """Return a suspension with stiffness k and damping c in all directions."""
        return cls(k, k, c, c)


@dataclass(frozen=True)
class Runout:
    """Race that is not a circle about the spindle.

    Ball centres at X(theta) = d + h n + h' t on the rotating axes, where
    h = R + oval cos(2 (theta - oval_angle)), n = (cos theta, sin theta), t = dn/dtheta and
    d = ``offset``; axis 1 points at the unbalance.
    """

    offset: tuple[float, float] = (0.0, 0.0)
    oval: float = 0.0
    oval_angle: float = 0.0


@dataclass(frozen=True)
class Friction:
    """Friction |F| <= f max(N, 0), f = arm / a + constant; in slip opposite to theta'."""

    arm: float = 0.0
    constant: float = 0.0


@dataclass(frozen=True)
class Contact:
    """Contact of balls that cannot pass each other, with Newton's restitution.

    Impacts slower than ``rest_speed`` [m/s], which is |s_j' - s_i'|, are plastic.
    """

    restitution: float = 0.0
    rest_speed: float = 1e-4


@dataclass(frozen=True)
class Motor:
    """Speed controller and rotor, so that the spindle speed is a state.

    T = clip(raw, -limit, limit) - slope w with raw = kp (w_cmd - w) + ki z, and
    z' = w_cmd - w - (raw - clip(raw)) / kp. The spindle's segments are the command w_cmd.
    """

    inertia: float
    kp: float = 0.0
    ki: float = 0.0
    limit: float = 0.0
    slope: float = 0.0


@dataclass(frozen=True)
class Swing:
    """Segment in which the speed follows half a cosine, with a total ``change`` [rad/s]."""

    duration: float
    change: float


@dataclass(frozen=True)
class Spindle:
    """Speed (or, with a motor, command) from ``speed`` on, in segments.

    A segment is a Swing, or [duration, acceleration]. After the last segment the speed is constant.
    Without ``feel_acceleration`` the angle follows the profile, but psi'' causes no inertia forces.
    """

    speed: float = 0.0
    angle: float = 0.0
    segments: tuple[tuple[float, float] | Swing, ...] = ()
    feel_acceleration: bool = True


@dataclass(frozen=True)
class Params:
    """Rotor with its balls.

    ``mass`` is the total moving mass, balls included; ``unbalance_mass`` M0 carries the
    eccentricity; its default is the mass without balls. ``spin``: balls roll without slip.
    """

    mass: float
    suspension: Suspension
    eccentricity: float = 0.0
    race_radius: float = 0.01
    ball_masses: tuple[float, ...] = ()
    ball_radii: tuple[float, ...] = ()
    unbalance_mass: float | None = None
    drag: float = 0.0
    spin: bool = True
    gravity: tuple[float, float] = (0.0, 0.0)
    runout: Runout = field(default_factory=Runout)
    friction: Friction = field(default_factory=Friction)
    spindle: Spindle = field(default_factory=Spindle)
    motor: Motor | None = None
    contact: Contact | None = None

    def __post_init__(self) -> None:
        if len(self.ball_masses) != len(self.ball_radii):
            raise ValueError("as many ball radii as ball masses, please")
        if self.motor is not None and not self.spindle.feel_acceleration:
            raise ValueError("with a motor, psi'' cannot be left out")

    @property
    def count(self) -> int:
        """Return the number of balls n."""
        return len(self.ball_masses)

    @property
    def carrier_mass(self) -> float:
        """Return M0, the mass that carries the unbalance [kg]."""
        return (
            self.mass - sum(self.ball_masses)
            if self.unbalance_mass is None
            else (self.unbalance_mass)
        )

    def friction_coefficients(self) -> tuple[float, ...]:
        """Return the friction coefficient f_i of each ball."""
        return tuple(self.friction.arm / a + self.friction.constant for a in self.ball_radii)

    def but(self, **changes: object) -> "Params":
        """Return the parameters with some fields replaced."""
        return replace(self, **changes)  # type: ignore[arg-type]
