"""Random drives for benchmarks/identification.py, and what a bench records of them."""

import math
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.comparison import without_balls
from ab_sim.analysis.offline import run_scene
from ab_sim.identification.measured import DISPLACEMENT, Measured
from ab_sim.identification.speed_profile import schedule_from
from ab_sim.scene import Scene, check_scene
from ab_sim.scene.load import changed_scene

NOISE = 0.01
"""Of the signals' r.m.s."""
OFF = 0.3
"""Logarithm of the factor by which the scene that a fit begins with may be off."""
PARAMETERS = {
    "hardening_suspension": {"cubic_stiffness": 1e6},
    "race_runout": {"offset_1": 1e-6},
    "rolling_friction": {"arm": 1e-7},
    "unequal_suspension": {"apart": 1e-3},
}
"""Of effects that are added: each with a number that is then made larger or smaller."""


class Blind(NamedTuple):
    """A drive, and what a fit begins with."""

    scene: Scene
    guess: Scene
    true: dict[str, float]
    angles: list[float]


def blind_drive(seed: int, friction: bool) -> Blind:
    """A random one of two balls, run up through its critical speed."""
    numbers = np.random.default_rng([seed, 20261125])

    def between(low: float, high: float) -> float:
        return float(np.exp(numbers.uniform(math.log(low), math.log(high))))

    mass, radius = 0.1, 0.01
    stiffness, eccentricity = between(600.0, 1600.0), between(5e-5, 2e-4)
    critical = math.sqrt(stiffness / mass)
    true = {
        "effects.suspension.stiffness": stiffness,
        "effects.suspension.damping": 2.0 * between(0.05, 0.2) * mass * critical,
        "rotor.eccentricity": eccentricity,
        # From too light to balance to twice what is needed.
        "balls.mass": mass * eccentricity / (2.0 * radius) * between(0.9, 2.0),
        "effects.viscous_drag.coefficient": between(0.1, 0.5),
    }
    effects: dict[str, Any] = {"suspension": {}, "viscous_drag": {}, "spindle_acceleration": {}}
    balls: dict[str, Any] = {"count": 2}
    if friction:
        true["effects.rolling_friction.arm"] = between(1e-6, 4e-6)
        effects["rolling_friction"], balls["radius"] = {}, 1e-3
    angles = numbers.uniform(-math.pi, math.pi, 2).tolist()
    acceleration = between(60.0, 120.0)
    raw: dict[str, Any] = {
        "name": f"drive {seed}",
        "rotor": {"total_mass": mass},
        "race": {"radius": radius},
        "balls": balls,
        "effects": effects,
        "start": {"ball_angles": angles},
        "spindle": {"max_speed": 420.0, "max_acceleration": 250.0},
        "profile": {
            "kind": "start_up", "acceleration": acceleration, "target_speed": 2.0 * critical,
        },
        "solver": {"step": 0.001},
        "duration": round(2.0 * critical / acceleration + 1.0, 1),
    }  # fmt: skip
    guess = {key: value * math.exp(numbers.uniform(-OFF, OFF)) for key, value in true.items()}
    return Blind(_scene(raw, true), _scene(raw, guess), true, angles)


def _scene(raw: dict[str, Any], values: dict[str, float]) -> Scene:
    made = {key: dict(value) if isinstance(value, dict) else value for key, value in raw.items()}
    made["effects"] = {name: dict(value) for name, value in raw["effects"].items()}
    for key, value in values.items():
        section, *rest = key.split(".")
        if section == "effects":
            made["effects"][rest[0]][rest[1]] = value
        else:
            made[section][rest[0]] = value
    return check_scene(made, made["name"])


def recordings_of(scene: Scene, seed: int) -> list[Measured]:
    """One with the balls, one without."""
    numbers = np.random.default_rng([seed, 7])
    return [
        _recorded(scene, "with", True, numbers),
        _recorded(without_balls(scene), "without", False, numbers),
    ]


def _recorded(scene: Scene, name: str, balls: bool, numbers: np.random.Generator) -> Measured:
    run = run_scene(scene).trajectory
    across = run.position[1:, :2]
    size = NOISE * float(np.sqrt(np.mean(across**2)))
    return Measured(
        name,
        run["time"][1:],
        across + size * numbers.standard_normal(across.shape),
        (0.0, math.pi / 2),
        DISPLACEMENT,
        schedule_from(run["time"], run["speed"], run["angle"], name),
        True,
        balls,
    )


def drive_with(blind: Blind, effect: str, seed: int) -> tuple[Scene, float]:
    """The drive with an effect more, and by how much that changes its signals, in noise."""
    wanted = float(np.random.default_rng([seed, 11]).uniform(0.5, 2.0))
    plain = run_scene(blind.scene).trajectory.position[:, :2]
    noise = NOISE * float(np.sqrt(np.mean(plain**2)))
    ((name, size),) = PARAMETERS[effect].items()
    change = 0.0
    for _ in range(8):
        scene = _richer(blind.scene, effect, name, size)
        moved = run_scene(scene).trajectory.position[:, :2]
        change = float(np.sqrt(np.mean((moved - plain) ** 2))) / noise
        if abs(change / wanted - 1.0) < 0.2:
            break
        size *= min(max(wanted / max(change, 1e-9), 0.03), 30.0)
    return scene, change


def _richer(scene: Scene, effect: str, name: str, size: float) -> Scene:
    if effect != "unequal_suspension":
        changes: dict[str, Any] = {f"effects.{effect}": {name: size}}
        if effect == "rolling_friction":
            changes["balls.radius"] = 1e-3
        return changed_scene(scene, changes, effect)
    equal, others = scene.effects["suspension"], scene.as_mapping()["effects"]
    assert isinstance(others, dict)
    unequal = {
        "stiffness_1": equal.stiffness * (1.0 + size), "damping_1": equal.damping,
        "stiffness_2": equal.stiffness * (1.0 - size), "damping_2": equal.damping,
        "axis_angle": 0.3,
    }  # fmt: skip
    kept = {key: value for key, value in others.items() if key != "suspension"}
    return changed_scene(scene, {"effects": {**kept, effect: unequal}}, effect)
