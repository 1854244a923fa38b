"""The paper's drive as a scene: what its dimensionless numbers leave open is chosen here."""

from typing import Any

from ab_sim import Scene
from ab_sim.scene.load import check_scene

MU_OVER_DELTA = 0.03
"""m_d e / (M d), which the paper does not print; mu and delta count by their ratio only."""
ZETA, ZETA_B = 0.02, 0.1
"""Of suspension and race, neither printed: these give figure 2's threshold."""
MASS, STIFFNESS = 1.0, 1.0
"""M [kg], K [N/m]: so that w_n = 1 rad/s, and speeds are the paper's Omega."""
ECCENTRICITY = 1e-3
"""e [m]; whirl counts in it."""
MU = 0.5
"""m_d / M."""

DAMPING = "effects.suspension.damping"
"""C = 2 M w_n zeta [N s/m], the key of the maps' vertical axes."""


def drive(
    eta: float, balls: int = 3, zeta: float = ZETA, zeta_b: float = ZETA_B, **start: Any
) -> Scene:
    """A scene of the paper's model, (5)-(9), at speeds that are held.

    Parameters
    ----------
    eta
        m_b d / (m_d e), of one ball.
    balls
        How many.
    zeta
        C / (2 M w_n).
    zeta_b
        C_B / (2 m_b w_n).
    start
        As of a scene's start.
    """
    mass = eta * MU_OVER_DELTA * MASS
    scene = {
        "name": f"three-ball paper, eta = {eta:g}",
        "rotor": {
            "total_mass": MASS,
            "eccentric_mass": MU * MASS,
            "eccentricity": ECCENTRICITY,
        },
        "race": {"radius": MU / MU_OVER_DELTA * ECCENTRICITY},
        "balls": {"count": balls, "mass": mass},
        "effects": {
            "suspension": {"stiffness": STIFFNESS, "damping": 2.0 * zeta * MASS},
            "viscous_drag": {"coefficient": 2.0 * zeta_b * mass},
            "spindle_acceleration": {},
        },
        "start": start,
        "spindle": {"max_speed": 10.0, "max_acceleration": 10.0},
        "solver": {"step": 0.01},
        "duration": 1000.0,
    }
    return check_scene(scene, "the three-ball paper's drive")
