"""Whether collocation delivers the error asked for: smooth scenes of both plants at random.

    python benchmarks/collocation_at_random.py [--out docs] [--scenes 20]

writes collocation-at-random.json. For each scene and tolerance: the largest error in a ball's angle
over a second, beside rk8 at 0.05 ms, over the tolerance, which is that of each span; and how many
times longer rk8 takes at the step of a ladder whose error is no larger. How much errors grow by
themselves differs from scene to scene: ``grown`` is what a start becomes at most that is 1e-9 rad
off in one ball's angle, or as much in its rate times the spindle's speed, or in the deck.
"""

import contextlib
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments  # noqa: E402

from ab_sim.cli.outputs import write_json  # noqa: E402
from ab_sim.drive import Drive  # noqa: E402
from ab_sim.errors import SceneError  # noqa: E402
from ab_sim.studies.effect_cost import conditions  # noqa: E402
from tests.integrate.random_scenes import PLANTS, scene_at_random  # noqa: E402

SECONDS, EVERY, FINE, OFF = 1.0, 0.005, 5e-5, 1e-9
TOLERANCES = (1e-7, 1e-9, 1e-11)
LADDER = (0.0025, 0.00125, 0.000625, 0.0003125, 0.00015625)


def angles(drive: Drive, off: np.ndarray | float = 0.0) -> np.ndarray:
    """The balls' angles on the common grid, from a start that is so far off."""
    drive.reset()
    drive._state += off
    run = drive.advance(round(SECONDS / drive.step)).decimated(round(EVERY / drive.step))
    return np.asarray(run.ball_angles)


def cpu(drive: Drive, repeats: int) -> float:
    """Of the quickest of some runs [us per simulated second]."""
    times = []
    for _ in range(repeats):
        drive.reset()
        begin = time.thread_time_ns()
        drive.advance(round(SECONDS / drive.step))
        times.append((time.thread_time_ns() - begin) / SECONDS / 1e3)
    return min(times)


def measure(plant: str, seed: int, repeats: int) -> list[dict[str, Any]]:
    """One scene at all tolerances."""

    def drive_of(stepper: str, step: float, **parameters: float) -> Drive:
        own = {"parameters": parameters} if parameters else {}
        return Drive(
            scene_at_random(plant, seed, stepper=stepper, step=step, **own), energy_balance=True
        )

    fine = drive_of("rk8", FINE)
    true = angles(fine)
    speed, layout = fine.scene.start.speed, fine.layout
    sizes = np.zeros(layout.size)
    sizes[layout.deck] = fine.system.deck_model.scale(fine.scene.race.radius, speed)
    sizes[layout.angles], sizes[layout.rates] = 1.0, speed
    grown = max(
        np.abs(angles(fine, OFF * off) - true).max() / OFF for off in np.diag(sizes) if off.any()
    )
    ladder = []
    for step in LADDER:
        with contextlib.suppress(SceneError):  # beyond its stability limit
            ladder.append(drive_of("rk8", step))
    reached = [np.abs(angles(drive) - true).max() for drive in ladder]
    times = [cpu(drive, repeats) for drive in ladder]
    rows = []
    for tolerance in TOLERANCES:
        drive = drive_of("collocation", EVERY, tolerance=tolerance)
        error = float(np.abs(angles(drive) - true).max())
        enough = [one for one, other in zip(times, reached, strict=True) if other <= error]
        own = cpu(drive, repeats)
        rows.append(
            {
                "plant": plant,
                "seed": seed,
                "tolerance": tolerance,
                "error": error,
                "error_over_tolerance": error / tolerance,
                "grown": float(grown),
                "us_per_s": own,
                "rk8_takes_times": enough[0] / own if enough else None,
            }
        )
    return rows


def main() -> None:
    """Measure and write the file."""
    parser = arguments("Errors of collocation on scenes at random.", 5)
    parser.add_argument("--scenes", type=int, default=20, help="of each plant")
    asked, rows = parser.parse_args(), []
    for plant in PLANTS:
        for seed in range(asked.scenes):
            rows += measure(plant, seed, asked.repeats)
            for row in rows[-len(TOLERANCES) :]:
                print({k: f"{v:.3g}" if isinstance(v, float) else v for k, v in row.items()})
    report = {**conditions(), "repeats": asked.repeats, "rows": rows}
    write_json(report, str(asked.out / "collocation-at-random.json"))


if __name__ == "__main__":
    main()
