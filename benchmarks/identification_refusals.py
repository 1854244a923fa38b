"""Count sound recordings that `ab-sim identify` refuses: bare drives that may ring after a run-up.

Example: python benchmarks/identification_refusals.py --first 0 --drives 400 --fits 20
"""

import argparse
import json
import math
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow
import pyarrow.parquet

from ab_sim.analysis.offline import run_scene
from ab_sim.errors import InputError
from ab_sim.identification.inputs import measured_of
from ab_sim.identification.mapping import mapping_of
from ab_sim.identification.measured import ACCELERATION, DISPLACEMENT, UNITS, Measured
from ab_sim.identification.run import Question, run_identification
from ab_sim.scene import Scene, check_scene
from ab_sim.scene.load import changed_scene

MASS, NOISE, HOLD = 0.1, 0.01, 1.5
"""Deck [kg]; noise, as a share of the signals' r.m.s.; time at the final speed [s]."""
KEYS = ("effects.suspension.stiffness", "effects.suspension.damping", "rotor.eccentricity")
RIGHT = 0.02
"""Relative error of the stiffness up to which a fit is right."""


def recording(seed: int, folder: Path) -> tuple[Scene, Measured, dict[str, Any]]:
    """Return a random drive, its recording, and what was drawn.

    Raises:
        InputError: the recording is refused before any fit.
    """
    numbers = np.random.default_rng([seed, 20261128])

    def between(low: float, high: float) -> float:
        return float(np.exp(numbers.uniform(math.log(low), math.log(high))))

    stiffness, ratio, acceleration = between(600, 1600), between(1e-3, 0.1), between(10, 400)
    final, axes = float(numbers.uniform(0.7, 2.5)), int(numbers.integers(1, 3))
    kind = (DISPLACEMENT, ACCELERATION)[int(numbers.integers(2))]
    critical = math.sqrt(stiffness / MASS)
    damping = 2.0 * ratio * MASS * critical
    raw: dict[str, Any] = {
        "name": f"drive {seed}",
        "rotor": {"total_mass": MASS, "eccentricity": between(5e-5, 2e-4)},
        "race": {"radius": 0.01},
        "balls": {"count": 0},
        "effects": {
            "suspension": {"stiffness": stiffness, "damping": damping},
            "spindle_acceleration": {},
        },
        "spindle": {"max_speed": 420.0, "max_acceleration": 500.0},
        "profile": {
            "kind": "start_up", "acceleration": acceleration, "target_speed": final * critical,
        },
        "solver": {"step": 0.001},
        "duration": round(final * critical / acceleration + HOLD, 2),
    }  # fmt: skip
    scene = check_scene(raw, f"drive {seed}")
    run = run_scene(scene).trajectory
    names = (("x", "y") if kind == DISPLACEMENT else ("ax", "ay"))[:axes]
    columns = {"t": run["time"], "w": run["speed"]}
    for name in names:
        noise = NOISE * float(np.std(run[name])) * numbers.standard_normal(len(run))
        columns[name] = run[name] + noise
    file = folder / f"drive-{seed}.parquet"
    pyarrow.parquet.write_table(pyarrow.table(columns), file)
    mapping = {
        "time": {"column": "t"},
        "speed": {"column": "w"},
        "signals": [{"column": name, "unit": UNITS[kind]} for name in names],
    }
    drawn = {
        "seed": seed, "damping_ratio": ratio, "acceleration": acceleration, "final": final,
        "axes": axes, "kind": kind,
    }  # fmt: skip
    return scene, measured_of(file, scene, mapping_of(mapping, "benchmark")), drawn


def judged(scene: Scene, measured: Measured, seed: int) -> dict[str, Any]:
    """Fit a recording from start values up to 30 % off."""
    numbers = np.random.default_rng([seed, 1])
    effect = scene.effects["suspension"]
    true = (effect.stiffness, effect.damping, scene.rotor.eccentricity)
    off = np.exp(numbers.uniform(-0.3, 0.3, 3))
    guess = changed_scene(
        scene, {key: float(x * by) for key, x, by in zip(KEYS, true, off, strict=True)}, "guess"
    )
    try:
        found = run_identification(guess, [measured], Question(KEYS, propose=False))
    except InputError as error:
        return {"refused": str(error)}
    error = found[KEYS[0]].value / true[0] - 1.0
    return {"refused": "", "verdict": found.verdict, "right": abs(error) < RIGHT, "error": error}


def main() -> None:
    """Count, and print one JSON line for each drive that is refused or doubted."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=0, help="seed of the first drive")
    parser.add_argument("--drives", type=int, default=400, help="number of drives")
    parser.add_argument("--fits", type=int, default=400, help="number of doubted drives to fit")
    given = parser.parse_args()
    before, doubted, fits = 0, 0, list[dict[str, Any]]()
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(given.first, given.first + given.drives):
            try:
                scene, measured, drawn = recording(seed, Path(folder))
            except InputError as error:
                before += 1
                print(json.dumps({"seed": seed, "refused": str(error)}), flush=True)
                continue
            if measured.doubt:
                doubted += 1
                if len(fits) < given.fits:
                    fits.append({**drawn, **judged(scene, measured, seed)})
                    print(json.dumps(fits[-1]), flush=True)
    print(
        f"{given.drives} drives: {before} refused before the fit, {doubted} doubted, {len(fits)} "
        f"of these fitted: {sum(bool(fit['refused']) for fit in fits)} refused, "
        f"{sum(bool(fit.get('right')) for fit in fits)} right"
    )


if __name__ == "__main__":
    main()
