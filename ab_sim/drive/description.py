"""Description of a scene's run, kept with its results."""

import math
from collections.abc import Mapping
from typing import Any

import ab_sim
from ab_sim.drive.explanation import explain
from ab_sim.drive.rows import channels_of
from ab_sim.engine.integrate.choose import choose_stepper
from ab_sim.model.dynamics.assemble import system_of
from ab_sim.scene.model import Scene


def describe(scene: Scene, accuracy: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Describe the components of a scene's run as JSON-able values.

    ``check_scene(describe(scene)["scene"], "a recording")`` returns the scene.

    Args:
        scene: scene with the solver that the drive uses, not with an accuracy, so that a repetition
            gives the same bits.
        accuracy: origin of that solver, ``WorkPrecision.report``; None if no accuracy was
            requested.
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
        "deck": None if scene.deck is None else _in_space(scene),
        **explain(scene),
    }


def _in_space(scene: Scene) -> dict[str, Any]:
    """Return the positions of a deck's parts in space, on deck axes [m]."""
    heights = scene.race.heights
    return {
        "mounts": [list(mount.position) for mount in scene.mounts],
        "race_heights": list(heights),
        "ball_heights": [heights[race] for race in scene.balls.races],
        "rotor_height": scene.rotor.height,
    }
