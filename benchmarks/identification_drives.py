"""Random drives for benchmarks/identification.py, and their recordings from a test bench."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow
import pyarrow.parquet

from ab_sim.analysis.comparison import without_balls
from ab_sim.analysis.offline import run_scene
from ab_sim.identification.files import measured_of
from ab_sim.identification.mapping import mapping_of
from ab_sim.identification.measured import ACCELERATION, DISC_ANGLE, DISPLACEMENT, UNITS, Measured
from ab_sim.identification.spindle import schedule_from
from ab_sim.scene import Scene, check_scene
from ab_sim.scene.load import changed_scene

NOISE = 0.01
"""Standard deviation of the noise, relative to the signals' r.m.s."""
MASS, HELD = 0.1, 1.5
"""Mass of the deck [kg], and time at the final speed of a ringing drive [s]."""
OFF = 0.3
"""Largest logarithm of the factor by which the scene of a fit's start is off."""
FAR = (0.2, 0.6)
"""Smallest and largest relative error of each start value of a far start."""
PARAMETERS = {
    "hardening_suspension": {"cubic_stiffness": 1e6},
    "race_runout": {"offset_1": 1e-6},
    "rolling_friction": {"arm": 1e-7},
    "unequal_suspension": {"apart": 1e-3},
}
"""Effects that are added, each with a parameter that is then scaled."""


class Blind(NamedTuple):
    """Drive with the scene at which a fit starts."""

    scene: Scene
    guess: Scene
    true: dict[str, float]
    angles: list[float]


def blind_drive(seed: int, friction: bool, far: bool = False) -> Blind:
    """Return a random drive of two balls, run up through its critical speed."""
    numbers = np.random.default_rng([seed, 20261125])

    def between(low: float, high: float) -> float:
        return float(np.exp(numbers.uniform(math.log(low), math.log(high))))

    mass, radius = MASS, 0.01
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
    if far:
        factors = 1.0 + numbers.choice([-1.0, 1.0], len(true)) * numbers.uniform(*FAR, len(true))
    else:
        factors = np.exp(numbers.uniform(-OFF, OFF, len(true)))
    guess = dict(zip(true, (factors * np.array(list(true.values()))).tolist(), strict=True))
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


def recordings_of(scene: Scene, seed: int, zero_known: bool = True) -> list[Measured]:
    """Return a recording with the balls and one without; the zero of the encoder may be unknown."""
    numbers = np.random.default_rng([seed, 7])
    zero = 0.0 if zero_known else float(np.random.default_rng([seed, 8]).uniform(-math.pi, math.pi))
    found = [
        _recorded(scene, "with", True, numbers, zero),
        _recorded(without_balls(scene), "without", False, numbers, zero),
    ]
    return found if zero_known else [replace(each, free=(DISC_ANGLE,)) for each in found]


def _recorded(
    scene: Scene, name: str, balls: bool, numbers: np.random.Generator, zero: float
) -> Measured:
    run = run_scene(scene).trajectory
    across = run.position[1:, :2]
    size = NOISE * float(np.sqrt(np.mean(across**2)))
    return Measured(
        name,
        run["time"][1:],
        across + size * numbers.standard_normal(across.shape),
        (0.0, math.pi / 2),
        DISPLACEMENT,
        schedule_from(run["time"], run["speed"], run["angle"] + zero, name),
        True,
        balls,
    )


def ringing_drive(seed: int) -> tuple[Blind, dict[str, Any]]:
    """Return a random drive that may ring after its run-up without balls, and what was drawn."""
    blind, numbers = blind_drive(seed, False), np.random.default_rng([seed, 20261128])
    damping, stiffness = "effects.suspension.damping", blind.true["effects.suspension.stiffness"]
    critical = math.sqrt(stiffness / MASS)
    drawn = {
        "damping_ratio": math.exp(numbers.uniform(math.log(1e-3), math.log(0.1))),
        "acceleration": math.exp(numbers.uniform(math.log(10.0), math.log(400.0))),
        "final": float(numbers.uniform(0.7, 2.5)),
        "axes": int(numbers.integers(1, 3)),
        "kind": (DISPLACEMENT, ACCELERATION)[int(numbers.integers(2))],
    }
    speed, acceleration = drawn["final"] * critical, drawn["acceleration"]
    changes = {
        "spindle.max_acceleration": 500.0,
        "profile.acceleration": acceleration,
        "profile.target_speed": speed,
        "duration": round(speed / acceleration + HELD, 2),
        "balls.mass": blind.true["balls.mass"],
    }
    true = {
        "effects.suspension.stiffness": stiffness,
        damping: 2.0 * drawn["damping_ratio"] * MASS * critical,
        "rotor.eccentricity": blind.true["rotor.eccentricity"],
    }
    off = blind.guess.effects["suspension"].damping / blind.true[damping]
    scene = changed_scene(blind.scene, {**changes, damping: true[damping]}, "ringing")
    guess = changed_scene(blind.guess, {**changes, damping: true[damping] * off}, "ringing")
    return Blind(scene, guess, true, []), drawn


def table_of(blind: Blind, drawn: dict[str, Any], seed: int, file: Path) -> Measured:
    """Write a recording without balls as a table of speed and signals, and read it."""
    run, numbers = (
        run_scene(without_balls(blind.scene)).trajectory,
        np.random.default_rng([seed, 9]),
    )
    names = (("x", "y") if drawn["kind"] == DISPLACEMENT else ("ax", "ay"))[: drawn["axes"]]
    columns = {"t": run["time"], "w": run["speed"]}
    for name in names:
        noise = NOISE * float(np.std(run[name])) * numbers.standard_normal(len(run))
        columns[name] = run[name] + noise
    pyarrow.parquet.write_table(pyarrow.table(columns), file)
    mapping = {
        "time": {"column": "t"},
        "speed": {"column": "w"},
        "signals": [{"column": name, "unit": UNITS[drawn["kind"]]} for name in names],
    }
    return measured_of(file, blind.scene, mapping_of(mapping, "benchmark"), with_balls=False)


def drive_with(blind: Blind, effect: str, seed: int) -> tuple[Scene, float]:
    """Return the drive with a further effect, and the change of its signals in units of noise."""
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
