"""Scene of a sized drive: from rest to the running speed."""

import math
from typing import Any, NamedTuple

from ab_sim.base.presentation import LAST
from ab_sim.design.sizing.race_fit import FittingBalls
from ab_sim.design.sizing.specification import DriveSpecification
from ab_sim.scene.load import changed_scene, check_scene
from ab_sim.scene.model import Scene

TURN_OF_A_STEP = 0.2
"""Largest spindle angle of a step [rad]."""
RESTITUTION = 0.5
"""Restitution coefficient of colliding balls."""
NAME = "sized"


class Hold(NamedTuple):
    """Variable-speed period that holds the speed."""

    start_speed: float
    """Held speed [rad/s]."""
    duration: float
    """Duration [s]."""


def scene_of(
    balls: FittingBalls,
    specification: DriveSpecification,
    drag: float,
    hold: Hold | None = None,
) -> Scene:
    """Return the scene of a start-up with the largest unbalance.

    The last tenth of the run, over which final metrics are taken, starts ``specification.settle``
    after the running speed is reached.

    Args:
        balls, specification: balls and drive.
        drag: drag c_b on a ball [N s/m].
        hold: hold of the speed, or None.
    """
    speed, acceleration = specification.speed, specification.acceleration
    profile: dict[str, Any] = {
        "kind": "start_up",
        "acceleration": acceleration,
        "target_speed": speed,
    }
    reached = speed / acceleration
    if hold is not None:
        profile["variable_speed_period"] = hold._asdict()
        reached += hold.duration
    count = balls.count
    friction = [{"rolling_friction": {"arm": specification.friction_arm}}]
    content = {
        "name": NAME,
        "rotor": {
            "mass": specification.mass,
            "eccentricity": specification.largest_unbalance / specification.mass,
        },
        "race": {"radius": balls.path_radius},
        "balls": {"count": count, "mass": balls.mass, "radius": balls.radius},
        "effects": [
            {
                "suspension": {
                    "stiffness": specification.stiffness,
                    "damping": specification.damping,
                }
            },
            {"viscous_drag": {"coefficient": drag}},
            "spindle_acceleration",
            "ball_spin",
            *(friction if specification.friction_arm > 0.0 else ()),
        ],
        # Start at different angles: equal balls at one place never separate.
        "start": {
            "ball_angles": [round(2.0 * math.pi * (k / count) ** 1.2, 4) for k in range(count)]
        },
        "spindle": {"max_speed": 1.2 * speed, "max_acceleration": 1.2 * acceleration},
        "profile": profile,
        "solver": {"step": step_at(speed)},
        "balanced": {"residual_unbalance": specification.residual},
        "duration": (reached + specification.settle) / (1.0 - LAST),
    }
    return check_scene(content, NAME)


def with_contact(scene: Scene) -> Scene:
    """Return the scene with colliding balls."""
    changes = {"effects.ball_contact": {"restitution_coefficient": RESTITUTION}}
    return changed_scene(scene, changes, NAME)


def step_at(speed: float) -> float:
    """Return a round step [s] in which the spindle turns by at most ``TURN_OF_A_STEP``."""
    most = min(TURN_OF_A_STEP / speed, 1e-3)
    decade = 10.0 ** math.floor(math.log10(most))
    return max(
        round(digit * decade, 12) for digit in (1, 2, 5) if digit * decade <= most * 1.000001
    )
