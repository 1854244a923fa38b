"""Floquet verdicts against runs of the drive, at random points away from the border.

    python benchmarks/floquet_verdicts.py [--points 50] [--seed 1]

Each point is a drive at random, in the plane with an unequal suspension and gravity across the
shaft, or a deck in space, at a speed at random, and a periodic solution found for it. Two runs of
the drive, from the solution and from beside it, come together or part. Points whose largest modulus
is within .01 of 1 are left out: there runs would have to be too long. Prints a line per point.
"""

import argparse
import math
from typing import Any

import numpy as np

from ab_sim.analysis.floquet import solutions_of
from ab_sim.analysis.floquet.simulated import growth_of
from ab_sim.scene import Scene, check_scene, load_scene
from ab_sim.scene.load import changed_scene

NEAR = 0.01
SHRINKS = 1e-4
"""What the runs are long enough for, by the largest modulus."""


def plane(random: np.random.Generator) -> tuple[Scene, float]:
    """A drive in the plane, and a speed [rad/s]."""
    stiffness, damping = random.uniform(700.0, 1500.0, 2), random.uniform(0.1, 2.0, 2)
    raw: dict[str, Any] = {
        "name": "plane",
        "rotor": {"total_mass": 0.1, "eccentricity": 1e-4},
        "race": {"radius": 0.01},
        "balls": {"count": 2, "mass": random.uniform(4e-4, 1.2e-3), "radius": 1e-3},
        "effects": {
            "unequal_suspension": {
                "stiffness_1": stiffness[0], "stiffness_2": stiffness[1],
                "damping_1": damping[0], "damping_2": damping[1],
            },
            "gravity": {"tilt": random.uniform(0.0, 1.5)},
            "viscous_drag": {"coefficient": random.uniform(0.1, 2.0)},
            "spindle_acceleration": {},
            "ball_spin": {},
        },
        "start": {"ball_angles": random.uniform(-math.pi, math.pi, 2).tolist()},
        "spindle": {"max_speed": 1000.0, "max_acceleration": 1000.0},
        "solver": {"stepper": "rk8", "step": 5e-4},
        "duration": 1.0,
    }  # fmt: skip
    return check_scene(raw, "plane"), float(random.uniform(60.0, 350.0))


def deck(random: np.random.Generator) -> tuple[Scene, float]:
    """A deck in space, and a speed [rad/s]."""
    scene = load_scene("feeding-deck")
    damping = float(random.uniform(0.02, 0.8))
    changes = {
        "name": "deck",
        "mounts": [{**m.model_dump(mode="json"), "damping": damping} for m in scene.mounts],
        "balls.mass": float(random.uniform(1.7e-4, 3e-4)),
        "race.height": float(random.uniform(0.0, 5e-3)),
        "rotor.height": float(random.uniform(0.0, 5e-3)),
        "effects.viscous_drag.coefficient": float(random.uniform(2e-3, 5e-2)),
        "start.ball_angles": random.uniform(-math.pi, math.pi, 2).tolist(),
        "solver.step": 5e-4,
    }
    return changed_scene(scene, changes, "deck"), float(random.uniform(110.0, 450.0))


def main() -> None:
    """Points, until there are enough."""
    arguments = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    arguments.add_argument("--points", type=int, default=50)
    arguments.add_argument("--seed", type=int, default=1)
    given = arguments.parse_args()
    random = np.random.default_rng(given.seed)
    points = agreed = unstable = 0
    while points < given.points:
        scene, speed = (plane, deck)[points % 2](random)
        for found in solutions_of(scene, speed, "balanced" if random.random() < 0.7 else "start"):
            if found.largest == 0.0 or abs(found.largest - 1.0) < NEAR:
                continue
            turns = math.ceil(math.log(SHRINKS) / -abs(math.log(found.largest)))
            turns = min(max(turns, 30), 900)
            growth = growth_of(scene, found, turns, 1e-7)
            points, right = points + 1, (growth < 1.0) is found.stable
            agreed, unstable = agreed + right, unstable + (found.stable is False)
            print(
                f"{points:3d} {scene.name:5} {speed:6.1f} rad/s, {found.found_from:8}: "
                f"{found.verdict:8} {found.largest:.5f}; runs over {turns:3d} turns: {growth:.5f}"
                + ("" if right else "  DISAGREES"),
                flush=True,
            )
    print(f"{agreed} of {points} agree; {unstable} of them unstable")


if __name__ == "__main__":
    main()
