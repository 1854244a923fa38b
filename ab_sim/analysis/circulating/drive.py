"""What the closed form of circulating balls knows of a scene, and which scenes it does not know."""

from typing import NamedTuple

from ab_sim.analysis.equilibria.resting import base_rotor_of, resting_system, rotor_of
from ab_sim.dynamics.system import MASS, RACE_RADIUS, RADIUS, ROLLING_MASS, System
from ab_sim.equations.motion import Ball
from ab_sim.equations.sums import over_effects
from ab_sim.errors import SceneError
from ab_sim.scene.model import Scene


class BunchDrive(NamedTuple):
    """A planar drive with equal balls in an isotropic linear suspension, as numbers."""

    mass: float
    """M, with the balls [kg]."""
    unbalance: float
    """M0 e [kg m]."""
    stiffness: float
    """k [N/m]."""
    damping: float
    """c [N s/m]."""
    radius: float
    """R [m]."""
    drag: float
    """c_b [N s/m]."""
    ball_mass: float
    """m [kg]."""
    rolling_mass: float
    """mu = m + I/a^2 [kg]; m where balls do not roll."""
    balls: int
    """n."""


def why_not(scene: Scene) -> str | None:
    """Why circulating balls are not looked for in a scene; None where they are."""
    if scene.balls.count == 0:
        return "there are no balls"
    if "ball_contact" in scene.effects:
        return "effects.ball_contact: balls that touch form a row and no bunch at one place"
    try:
        system = resting_system(scene)
    except SceneError as error:
        return str(error)
    rotor = rotor_of(system)
    if rotor is None:
        return "an effect changes the race or the deck in a way that the closed form does not know"
    if rotor.cubic_stiffness != 0.0:
        return "effects.hardening_suspension: the closed form is of a linear suspension"
    if len({*rotor.kinds}) > 1:
        return "balls.mass: the balls differ"
    if _drag_of(system) <= 0.0:
        return "effects.viscous_drag: without drag nothing drives the balls"
    if rotor.stiffness <= 0.0 or rotor.damping <= 0.0:
        return "effects.suspension: without stiffness or damping nothing holds the balls back"
    return None


def drive_of(scene: Scene) -> BunchDrive | None:
    """The numbers of a scene; None where ``why_not`` says why there are none."""
    if why_not(scene) is not None:
        return None
    system = resting_system(scene)
    rotor = base_rotor_of(system)
    ball = system.balls[0]
    return BunchDrive(
        mass=rotor.mass,
        unbalance=rotor.unbalance,
        stiffness=rotor.stiffness,
        damping=rotor.damping,
        radius=float(ball[RACE_RADIUS]),
        drag=_drag_of(system),
        ball_mass=float(ball[MASS]),
        rolling_mass=float(ball[ROLLING_MASS]),
        balls=len(system.balls),
    )


def _drag_of(system: System) -> float:
    """c_b on the first ball [N s/m]."""
    ball = Ball(*system.balls[0, [MASS, RADIUS]])
    return float(over_effects(system.effects, "ball_drag", 0.0, ball))
