"""The effects that come with the package, in the order in which their forces are summed."""

from math import hypot
from typing import TYPE_CHECKING, Annotated, NamedTuple

from ab_sim.base.errors import exact
from ab_sim.model.equations.motion import Ball, DeckMotion
from ab_sim.model.equations.neighbours import check_row
from ab_sim.scene.quantities import Number, quantity
from ab_sim.scene.registry import register
from ab_sim.tracing.functions import cos, sin, where

if TYPE_CHECKING:
    from ab_sim.scene.model import Scene


@register(
    "ball_contact",
    equation="s_i+1 - s_i >= D along the race, D from a_i + a_i+1; after an impact the balls part "
    "with restitution times the speed of approach",
    source="Newton's law of impact; Brogliato, Nonsmooth Mechanics (2016), ch. 4",
    uses_ball_radius=True,
)
class BallContact(NamedTuple):
    """Balls have a size: they collide, and can rest against each other in a packed row.

    Impacts are located within a step. They transfer momentum between balls and deck, and never add
    energy. Newton's law holds for all balls in contact at the impact: a ball that hits a row at
    rest sets the whole row in motion. In Newton's cradle, in contrast, elastic waves pass through
    the balls one after the other.

    Impacts and contacts have no friction. Contact forces act along the race; their component that
    presses both balls against the race is neglected. D is constant along an oval race. Where its
    radius of curvature is l, balls therefore touch too late by about
    (a_i + a_i+1)^3 (1/l^2 - 1/R^2) / 24, or too early if this is negative.
    """

    restitution_coefficient: Annotated[
        Number, quantity("separation speed divided by approach speed", "1", ge=0, le=1)
    ]
    rest_speed: Annotated[
        Number,
        quantity(
            "approach speed below which balls do not bounce but stay together", "m/s", gt=0, le=1.0
        ),
    ] = 1e-5

    def restitution(self, approach: float) -> float:
        return where(approach > self.rest_speed, self.restitution_coefficient, 0.0)

    def check_scene(self, scene: "Scene") -> None:
        """Refuse balls that do not fit on the race, or that overlap at the start."""
        if len(set(scene.balls.races)) > 1:
            raise ValueError(
                "effects.ball_contact: balls in more than one race (balls.race), where contacts "
                "are not modelled; put them into one race, or leave the effect out"
            )
        check_row(scene)


@register(
    "ball_spin",
    equation="energy I (w - s'/a)^2 / 2, I = 2/5 m a^2: inertia m + I/a^2 along the race, and the "
    "spindle's acceleration spins the ball up",
    source="thesis (2-2), (2-8), (2-11)",
    uses_ball_radius=True,
)
class BallSpin(NamedTuple):
    """Solid balls roll without slipping, so moving along the race also spins them up.

    The spin is the *absolute* one, which makes the thesis' (2-11) exactly the no-slip Lagrangian
    (docs/equations.md, 6).
    """

    def ball_inertia(self, ball: Ball) -> float:
        return 0.4 * ball.mass  # I / a^2


@register(
    "gravity",
    equation="g (sin(tilt) cos(direction), sin(tilt) sin(direction), -cos(tilt)) on moving parts",
    source="Newton; the equations contain acceleration less gravity, as an accelerometer reads it",
)
class Gravity(NamedTuple):
    """Weight of deck, unbalance and balls in the plane of the disc.

    On a deck in the plane, only the component across the shaft acts, and displacements count from
    the position at rest under gravity. On a deck in space, the component along the shaft acts too,
    and displacements count from the position with relaxed mounts.
    """

    tilt: Annotated[
        Number,
        quantity(
            "angle between shaft and vertical: 0 the disc lies flat, pi/2 the drive stands on edge",
            "rad",
            ge=-6.3,
            le=6.3,
        ),
    ]
    direction: Annotated[
        Number,
        quantity(
            "direction of gravity in the plane of the disc, from the x axis", "rad", ge=-6.3, le=6.3
        ),
    ] = -1.5707963267948966
    acceleration: Annotated[
        Number, quantity("g, acceleration of free fall", "m/s^2", ge=0, le=1e3)
    ] = 9.80665

    def gravity(self) -> tuple[float, float]:
        across = self.acceleration * sin(self.tilt)
        return (across * cos(self.direction), across * sin(self.direction))

    def weight(self) -> tuple[float, float, float]:
        across = self.acceleration * sin(self.tilt)
        along = -self.acceleration * cos(self.tilt)
        return (across * cos(self.direction), across * sin(self.direction), along)

    def check_scene(self, scene: "Scene") -> None:
        """Refuse gravity in the plane of the disc if no spring holds the deck."""
        if scene.deck is not None:
            return  # the position at rest is searched for, and a deck that nothing holds may fall
        pull = hypot(*self.gravity())
        held = (
            ("suspension", "stiffness"),
            ("unequal_suspension", "stiffness_1"),
            ("hardening_suspension", "cubic_stiffness"),
        )
        stiff = [
            name
            for name, key in held
            if name in scene.effects and getattr(scene.effects[name], key) > 0
        ]
        if pull > 0 and not stiff:
            raise ValueError(
                f"effects.gravity: pulls the deck aside with {pull:.3g} m/s^2, and no "
                "suspension with a stiffness holds it; name the effect suspension, leave out "
                "gravity, or lay the disc flat (tilt: 0)"
            )


@register(
    "hardening_suspension",
    equation="f = -k_3 |u|^2 u",
    source="Duffing's spring, isotropic; Genta, Dynamics of Rotating Systems (2005), ch. 8",
)
class HardeningSuspension(NamedTuple):
    """Cubic spring in parallel with the linear suspension, equal in all directions: rubber mounts.

    A deck in space has this spring in each of its mounts.
    """

    cubic_stiffness: Annotated[
        Number, quantity("k_3, force per displacement cubed", "N/m^3", ge=0, le=1e18)
    ]

    def deck_force(self, deck: DeckMotion) -> tuple[float, float]:
        stiffness = self.cubic_stiffness * (deck.x * deck.x + deck.y * deck.y)
        return (-stiffness * deck.x, -stiffness * deck.y)

    def mount_stiffening(self, square: float) -> float:
        return self.cubic_stiffness * square

    def mount_energy(self, square: float) -> float:
        return 0.25 * self.cubic_stiffness * square * square

    def deck_energy(self, deck: DeckMotion) -> float:
        square = deck.x * deck.x + deck.y * deck.y
        return 0.25 * self.cubic_stiffness * square * square


@register(
    "motor",
    equation="T = clip(T_a, +-T_max) - b w, T_a = k_p (w_c - w) + k_i z, z' = w_c - w - (T_a - "
    "clip(T_a)) / k_p",
    source="Sommerfeld effect: Dimentberg et al. (1997), Shock and Vibration 4; direct-current "
    "motor at limited voltage; anti-windup by back-calculation: Astrom and Murray, Feedback "
    "Systems (2008), 10.4",
)
class Motor(NamedTuple):
    """Speed loop with torque limit and back-EMF; unbalance and balls react on the rotor.

    The profile and live commands give the commanded speed w_c. A motor that is too weak stays
    caught at the critical speed. The times at which the torque reaches and leaves its limit are
    located within a step.
    """

    rotor_inertia: Annotated[
        Number,
        quantity(
            "I_r, inertia of rotor and disc about the shaft without M0 e^2; for a deck in "
            "space: of turning parts in addition to rotor.inertia",
            "kg m^2",
            ge=0,
        ),
    ]
    torque_limit: Annotated[
        Number,
        quantity("T_max, largest torque at standstill; 0: motor switched off", "N m", ge=0, le=1e6),
    ]
    proportional_gain: Annotated[
        Number,
        quantity(
            "k_p, torque per speed error (to switch the motor off: torque_limit 0)",
            "N m s/rad",
            gt=0,
            le=1e6,
        ),
    ]
    integral_gain: Annotated[
        Number, quantity("k_i, torque per integral of the speed error", "N m/rad", ge=0, le=1e6)
    ] = 0.0
    back_emf_slope: Annotated[
        Number, quantity("b, loss of torque per speed", "N m s/rad", ge=0, le=1e6)
    ] = 0.0

    def rotor_moment(self) -> float:
        return self.rotor_inertia

    def loop_torque(self, error: float, integral: float) -> float:
        return self.proportional_gain * error + self.integral_gain * integral

    def integral_rate(self, error: float, excess: float) -> float:
        # The integral follows the delivered torque, so it does not wind up at the limit.
        return error - excess / self.proportional_gain

    def largest_torque(self) -> float:
        return self.torque_limit

    def back_torque(self, speed: float) -> float:
        return self.back_emf_slope * speed

    def check_scene(self, scene: "Scene") -> None:
        """Refuse a motor without inertia, or without the effect of the spindle's acceleration."""
        # On a free deck, M0 turns about the mass centre of all that is not free to roll.
        eccentric = scene.eccentric_mass
        share = 1.0 - eccentric / (scene.total_mass - scene.balls.total_mass)
        if scene.deck is None and self.rotor_inertia == 0.0:
            if share > 1e-9 and scene.rotor.eccentricity > 0.0:
                return
            raise ValueError(
                "effects.motor.rotor_inertia = 0.0 kg m^2: must be more than 0; the rotor of a "
                "scene without a deck in space has no other inertia, unless rotor.eccentric_mass "
                "is less than the moving mass without balls"
            )
        if "spindle_acceleration" not in scene.effects:
            raise ValueError(
                "effects.motor: needs the effect spindle_acceleration too, because the spindle's "
                "acceleration depends on how unbalance and balls react to it; name both"
            )


@register(
    "race_friction",
    equation="|F_i| <= mu max(N_i, 0); F_i = -mu max(N_i, 0) sign(theta_i') while it slides",
    source="Coulomb's law; set-valued as in Leine and Nijmeijer, Dynamics and Bifurcations of "
    "Non-Smooth Mechanical Systems (2004), ch. 5",
)
class RaceFriction(NamedTuple):
    """Coulomb friction along the race, for balls that do not roll or are caged.

    The static and the sliding coefficient are equal. Sticking and reversals are treated as for
    rolling friction; in a scene with both effects, the coefficients add up.
    """

    coefficient: Annotated[
        Number,
        quantity("mu, friction force divided by the normal force of the race", "1", ge=0, le=10.0),
    ]

    def friction_coefficient(self, ball: Ball) -> float:
        return self.coefficient


@register(
    "race_runout",
    equation="X(theta) = d + h n + h' t with h = R + lobe cos 2 (theta - lobe_angle), n = (cos "
    "theta, sin theta)",
    source="support function of a convex curve, Gray, Modern Differential Geometry of Curves and "
    "Surfaces (1997), 6.8; d and lobe as measured by roundness standards (ISO 12181)",
)
class RaceRunout(NamedTuple):
    """Race that is displaced from the shaft axis by a vector d, and two-lobed (oval).

    X is the curve of the balls' centres. theta is the direction of its outward normal at the ball;
    on a round race this is the ball's direction from the race's centre. The oval's width in the
    direction theta is 2 h(theta).
    """

    offset_1: Annotated[
        Number, quantity("offset of the race's centre towards the unbalance", "m", ge=-1, le=1)
    ] = 0.0
    offset_2: Annotated[
        Number,
        quantity("offset of the race's centre 90 deg ahead of the unbalance", "m", ge=-1, le=1),
    ] = 0.0
    lobe: Annotated[
        Number, quantity("two-lobe amplitude: the radius varies by +-lobe", "m", ge=0, le=1)
    ] = 0.0
    lobe_angle: Annotated[
        Number,
        quantity("angle from the unbalance at which the race is widest", "rad", ge=-6.3, le=6.3),
    ] = 0.0

    def race_shape(self, c: float, s: float) -> tuple[float, float, float, float]:
        """Return h - R, x = dh/dtheta, l - R and dl/dtheta [m] where the normal is (c, s).

        h is the support function, x the position along the tangent, and l = h + h'' the radius of
        curvature, as in ``OnRace``.
        """
        two = 2.0 * self.lobe_angle
        ct, st = cos(two), sin(two)
        wide = (c * c - s * s) * ct + 2.0 * s * c * st
        skew = 2.0 * s * c * ct - (c * c - s * s) * st
        beyond = self.lobe * wide + self.offset_1 * c + self.offset_2 * s
        across = -2.0 * self.lobe * skew - self.offset_1 * s + self.offset_2 * c
        return (beyond, across, -3.0 * self.lobe * wide, 6.0 * self.lobe * skew)

    def race_arc(self, theta: float) -> float:
        """Return the length along the race up to theta, less R theta [m]."""
        return -1.5 * self.lobe * sin(2.0 * (theta - self.lobe_angle))

    def check_scene(self, scene: "Scene") -> None:
        """Refuse a race that is not convex, or that does not go around the shaft."""
        R, most = scene.race.radius, scene.race.radius / 4
        for key in ("offset_1", "offset_2", "lobe"):
            value = getattr(self, key)
            if abs(value) > most:
                raise ValueError(
                    f"effects.race_runout.{key} = {exact(value)} m: must be at most a quarter of "
                    f"race.radius = {exact(R)} m, so that the race is convex and goes around "
                    "the shaft"
                )


@register(
    "rolling_friction",
    equation="|F_i| <= (beta_b/a) max(N_i, 0); F_i = -(beta_b/a) max(N_i, 0) sign(theta_i') while "
    "it rolls",
    source="thesis (2-8), (2-11); docs/equations.md, 6",
    uses_ball_radius=True,
)
class RollingFriction(NamedTuple):
    """Friction against rolling, at most (beta_b/a) times the race's normal force on the ball.

    The law is set-valued: a ball at rest on the race sticks while the force needed to hold it is
    below this limit. Reversals, sticking, release, and the loss of contact with the race are
    located within a step. The normal force contains the deck's acceleration, so both are solved
    together.
    """

    arm: Annotated[
        Number,
        quantity("beta_b, arm of rolling friction; beta_b/a is the coefficient", "m", ge=0, le=1.0),
    ]

    def friction_coefficient(self, ball: Ball) -> float:
        return self.arm / ball.radius


@register(
    "spindle_acceleration",
    equation="M0 e psi'' across the unbalance; (m h - I/a) psi'' on each ball",
    source="thesis (2-9)..(2-11)",
)
class SpindleAcceleration(NamedTuple):
    """Inertia terms with the spindle's acceleration psi'', on unbalance and balls.

    Without this effect, the speed still follows its profile, but these terms are omitted, as if the
    speed changed infinitely slowly.
    """

    def spindle_acceleration(self, acceleration: float) -> float:
        return acceleration


@register(
    "suspension",
    equation="f = -c v - k u",
    source="thesis (2-3), (2-4), (2-9), (2-10)",
)
class Suspension(NamedTuple):
    """Insulators between deck and housing: a spring and a damper, equal in every direction."""

    stiffness: Annotated[Number, quantity("k, stiffness of the spring", "N/m", ge=0, le=1e12)]
    damping: Annotated[Number, quantity("c, damping of the damper", "N s/m", ge=0, le=1e9)]

    def deck_force(self, deck: DeckMotion) -> tuple[float, float]:
        k, c = self.stiffness, self.damping
        return (-c * deck.vx - k * deck.x, -c * deck.vy - k * deck.y)

    def deck_energy(self, deck: DeckMotion) -> float:
        return 0.5 * self.stiffness * (deck.x * deck.x + deck.y * deck.y)

    def deck_loss(self, deck: DeckMotion) -> float:
        return self.damping * (deck.vx * deck.vx + deck.vy * deck.vy)


@register(
    "unequal_suspension",
    equation="f_j = -c_j v_j - k_j u_j along the principal axes j = 1, 2, fixed in space",
    source="Genta, Dynamics of Rotating Systems (2005), ch. 3 (anisotropic supports)",
)
class UnequalSuspension(NamedTuple):
    """Springs and dampers along two principal axes; replaces the effect suspension."""

    stiffness_1: Annotated[
        Number, quantity("k_1, stiffness along principal axis 1", "N/m", ge=0, le=1e12)
    ]
    stiffness_2: Annotated[
        Number, quantity("k_2, stiffness along principal axis 2", "N/m", ge=0, le=1e12)
    ]
    damping_1: Annotated[
        Number, quantity("c_1, damping along principal axis 1", "N s/m", ge=0, le=1e9)
    ]
    damping_2: Annotated[
        Number, quantity("c_2, damping along principal axis 2", "N s/m", ge=0, le=1e9)
    ]
    axis_angle: Annotated[
        Number, quantity("angle from the x axis to principal axis 1", "rad", ge=-6.3, le=6.3)
    ] = 0.0

    def space_force(self, deck: DeckMotion) -> tuple[float, float]:
        c, s = cos(self.axis_angle), sin(self.axis_angle)
        f_p = -self.stiffness_1 * (c * deck.x + s * deck.y)
        f_p -= self.damping_1 * (c * deck.vx + s * deck.vy)
        f_q = -self.stiffness_2 * (c * deck.y - s * deck.x)
        f_q -= self.damping_2 * (c * deck.vy - s * deck.vx)
        return (c * f_p - s * f_q, s * f_p + c * f_q)

    def space_energy(self, deck: DeckMotion) -> float:
        c, s = cos(self.axis_angle), sin(self.axis_angle)
        u_p, u_q = c * deck.x + s * deck.y, c * deck.y - s * deck.x
        return 0.5 * (self.stiffness_1 * u_p * u_p + self.stiffness_2 * u_q * u_q)

    def space_loss(self, deck: DeckMotion) -> float:
        c, s = cos(self.axis_angle), sin(self.axis_angle)
        v_p, v_q = c * deck.vx + s * deck.vy, c * deck.vy - s * deck.vx
        return self.damping_1 * v_p * v_p + self.damping_2 * v_q * v_q

    def check_scene(self, scene: "Scene") -> None:
        """Refuse a second linear suspension."""
        if "suspension" in scene.effects:
            raise ValueError(
                "effects.unequal_suspension: replaces the effect suspension, and the scene names "
                "both; remove one of them"
            )


@register(
    "viscous_drag",
    equation="F_i = -c_b s_i', s_i' the ball's speed along the race: R theta_i' on a round one",
    source="thesis (2-4), (2-11); relative-stability (9), (10)",
)
class ViscousDrag(NamedTuple):
    """Drag on each ball against its speed relative to the race."""

    coefficient: Annotated[
        Number, quantity("c_b, drag force per speed relative to the race", "N s/m", ge=0, le=1e9)
    ]

    def ball_drag(self, ball: Ball) -> float:
        return self.coefficient
