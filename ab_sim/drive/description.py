"""What a run of a scene consists of, to be kept with its results."""

import math
from collections.abc import Mapping
from typing import Any

import ab_sim
from ab_sim.drive.rows import channels_of
from ab_sim.dynamics.assemble import system_of
from ab_sim.integrate.choose import choose_stepper
from ab_sim.scene.model import Scene


def describe(scene: Scene, accuracy: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """What a run of the scene consists of, as JSON-able values.

    ``check_scene(describe(scene)["scene"], "a recording")`` gives the scene back.

    Args:
        scene: with its solver, as a drive has it: whoever runs it again measures nothing, and gets
            the same bits.
        accuracy: how that solver was found, ``Price.report``, if an accuracy was asked for.
    """
    radii, system = scene.balls.radii, system_of(scene)
    return {
        "version": ab_sim.__version__,
        "scene": scene.as_mapping(),
        "effects": list(scene.effects),
        "sensors": list(scene.sensors),
        "stepper": choose_stepper(scene, system).stepper.name,
        "step": scene.solver.step,
        "channels": list(channels_of(scene, system)),
        "accuracy": None if accuracy is None else dict(accuracy),
        "race_radius": scene.race.radius,
        "eccentricity": scene.rotor.eccentricity,
        "balls": scene.balls.count,
        "ball_radii": None if any(map(math.isnan, radii)) else list(radii),
    }
