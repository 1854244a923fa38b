"""Parameters of a scene for the closed form of circulating balls, and its limits."""

from typing import NamedTuple

from ab_sim.analysis.equilibria.resting import resting_system, rotor_of
from ab_sim.base.errors import SceneError
from ab_sim.model.dynamics.system import MASS, RACE_RADIUS, RADIUS, ROLLING_MASS, System
from ab_sim.model.equations.motion import Ball
from ab_sim.model.equations.sums import over_effects
from ab_sim.scene.model import Scene


class BunchDrive(NamedTuple):
    """Parameters of a planar drive with equal balls in an isotropic linear suspension."""

    mass: float
    """Total mass M, with the balls [kg]."""
    unbalance: float
    """Unbalance M0 e [kg m]."""
    stiffness: float
    """Stiffness k [N/m]."""
    damping: float
    """Damping c [N s/m]."""
    radius: float
    """Race radius R [m]."""
    drag: float
    """Drag on a ball c_b [N s/m]."""
    ball_mass: float
    """Ball mass m [kg]."""
    rolling_mass: float
    """Effective mass mu = m + I/a^2 [kg]; m for balls that do not roll."""
    balls: int
    """Number of balls n."""


def why_not(scene: Scene) -> str | None:
    """Return the reason why the closed form does not cover a scene; None if it does."""
    drive_or_reason = _known(scene)
    return drive_or_reason if isinstance(drive_or_reason, str) else None


def drive_of(scene: Scene) -> BunchDrive | None:
    """Return the parameters of a scene; None if ``why_not`` gives a reason."""
    drive_or_reason = _known(scene)
    return None if isinstance(drive_or_reason, str) else drive_or_reason


def _known(scene: Scene) -> BunchDrive | str:
    """Return the parameters of a scene, or the reason why there are none."""
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
        return "an effect changes the race or the deck in a way that the closed form does not cover"
    drag, problem = _drag_of(system), None
    if rotor.cubic_stiffness != 0.0:
        problem = "effects.hardening_suspension: the closed form assumes a linear suspension"
    elif len({*rotor.kinds}) > 1:
        problem = "balls.mass: the balls differ"
    elif drag <= 0.0:
        problem = "effects.viscous_drag: without drag nothing drives the balls"
    elif rotor.stiffness <= 0.0 or rotor.damping <= 0.0:
        problem = "effects.suspension: without stiffness or damping nothing holds the balls back"
    if problem is not None:
        return problem
    ball = system.balls[0]
    return BunchDrive(
        mass=rotor.mass,
        unbalance=rotor.unbalance,
        stiffness=rotor.stiffness,
        damping=rotor.damping,
        radius=float(ball[RACE_RADIUS]),
        drag=drag,
        ball_mass=float(ball[MASS]),
        rolling_mass=float(ball[ROLLING_MASS]),
        balls=len(system.balls),
    )


def _drag_of(system: System) -> float:
    """Return the drag c_b on the first ball [N s/m]."""
    ball = Ball(*system.balls[0, [MASS, RADIUS]])
    return float(over_effects(system.effects, "ball_drag", 0.0, ball))
