"""Drives with known parameters, and recordings of them as from a test bench."""

import functools
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import ab_sim
from ab_sim.analysis.comparison import without_balls
from ab_sim.identification.measured import DISPLACEMENT, Measured
from ab_sim.model.spindle import SpeedSchedule
from ab_sim.scene.load import changed_scene, check_scene

MAP = """
time: {column: t, unit: s}
speed: {column: rpm, unit: rpm}
angle: {column: encoder, unit: deg}
signals: [{column: ch1, unit: mm}, {column: ch2, unit: mm}]
"""
Columns = dict[str, np.ndarray]


def scene(changes: Mapping[str, Any] | None = None) -> ab_sim.Scene:
    """Return a scene with two balls that passes the critical speed within a second.

    Parameters
    ----------
    changes
        Changes by dotted key.
    """
    raw: dict[str, Any] = {
        "name": "bench",
        "rotor": {"total_mass": 0.1, "eccentricity": 1.0e-4},
        "race": {"radius": 0.01},
        "balls": {"count": 2, "mass": 5.5e-4},
        "effects": {
            "suspension": {"stiffness": 1000.0, "damping": 2.0},
            "viscous_drag": {"coefficient": 0.22},
            "spindle_acceleration": {},
        },
        "start": {"ball_angles": [0.7, -2.0]},
        "spindle": {"max_speed": 420.0, "max_acceleration": 250.0},
        "profile": {"kind": "start_up", "acceleration": 120.0, "target_speed": 180.0},
        "solver": {"step": 0.001},
        "duration": 2.0,
    }
    made = check_scene(raw, "bench")
    return changed_scene(made, dict(changes), "test") if changes else made


@functools.lru_cache(maxsize=8)
def columns(true: str, balls: bool, seed: int, noise: float = 0.01) -> Columns:
    """Return a recording of a drive as a test bench would write it.

    Parameters
    ----------
    true
        Scene of the drive as JSON.
    balls
        Whether the balls are in the race.
    seed
        Seed of the noise.
    noise
        Standard deviation of the noise relative to the signals' r.m.s.
    """
    drive = check_scene(json.loads(true), "true")
    run = ab_sim.simulate(drive if balls else without_balls(drive)).trajectory
    across = 1e3 * run.position[:, :2]
    size = noise * float(np.sqrt(np.mean(across**2)))
    across = across + size * np.random.default_rng(seed).standard_normal(across.shape)
    return {
        "t": run["time"],
        "rpm": run["speed"] * 60.0 / (2.0 * math.pi),
        "encoder": np.degrees(run["angle"]),
        "ch1": across[:, 0],
        "ch2": across[:, 1],
    }


def recorded(
    drive: ab_sim.Scene, balls: bool = True, seed: int = 0, noise: float = 0.01
) -> Columns:
    """Return the ``columns`` of a scene as copies, which may be changed."""
    found = columns(json.dumps(drive.as_mapping()), balls, seed, noise)
    return {name: column.copy() for name, column in found.items()}


def measured(drive: ab_sim.Scene, balls: bool = True) -> Measured:
    """Return a recording of the displacement with 1 % noise, as used by the fit."""
    table = recorded(drive, balls)
    signals = 1e-3 * np.column_stack([table["ch1"], table["ch2"]])[1:]
    return Measured(
        "with" if balls else "bare", table["t"][1:], signals, (0.0, math.pi / 2), DISPLACEMENT,
        SpeedSchedule.of_scene(drive), True, balls,
    )  # fmt: skip


def write(table: Mapping[str, Any], path: Path) -> Path:
    """Write a table as CSV and return its path."""
    rows = zip(*table.values(), strict=True)
    text = [",".join(table), *(",".join(f"{cell}" for cell in row) for row in rows)]
    path.write_text("\n".join(text) + "\n", encoding="utf-8")
    return path


def mapping(folder: Path, text: str = MAP) -> Path:
    """Write a mapping file and return its path."""
    path = folder / "map.yaml"
    path.write_text(text)
    return path


def bench(folder: Path, drive: ab_sim.Scene, name: str, balls: bool = True, seed: int = 0) -> Path:
    """Write a recording of a drive with 1 % noise as CSV and return its path."""
    return write(recorded(drive, balls, seed), folder / f"{name}.csv")
