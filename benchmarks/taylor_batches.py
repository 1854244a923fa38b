"""Benefit of Taylor's method in batches for all smooth effects.

    python benchmarks/taylor_batches.py [--out docs] [--scenes 6] [--repeats 9]

writes taylor-batches.json. Eight parallel runs differ in the balls' mass, with samples every 5 ms.
Times are CPU times of the compiled code, with all settings of a scene in turns. The scenes are
random, of both plants, with every effect without events. Errors in a ball's angle are against rk8
at 0.05 ms. Rows have the time of Taylor's method [us per simulated second], and the ratio of the
time of the fastest rk8, over a ladder of steps, with no larger error; medians over repeats.
"""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments  # noqa: E402
from beside import width  # noqa: E402

from ab_sim.analysis.effect_cost import conditions  # noqa: E402
from ab_sim.base.errors import SceneError  # noqa: E402
from ab_sim.cli.outputs import write_json  # noqa: E402
from ab_sim.design.batch import simulate_batch  # noqa: E402
from ab_sim.scene import Scene  # noqa: E402
from ab_sim.scene.load import changed_scene  # noqa: E402
from tests.integrate.random_scenes import PLANTS, scene_at_random  # noqa: E402

EVERY, FINE = 0.005, 5e-5
TOLERANCES = (1e-5, 1e-7, 1e-9, 1e-11)
LADDER = (0.005, 0.0025, 0.00125, 0.000625, 0.0003125)
FACTORS = [1.0 + 0.01 * k for k in range(8)]
"""Factors on the balls' mass in the runs of a batch."""


class Setting:
    """Batch of a scene with a stepper.

    Parameters
    ----------
    scene
        Scene to run.
    stepper
        Name of the stepper.
    step
        Integration step [s].
    tolerance
        Tolerance of steppers that have one.
    """

    def __init__(self, scene: Scene, stepper: str, step: float, tolerance: float | None) -> None:
        own = {} if tolerance is None else {"solver.parameters": {"tolerance": tolerance}}
        solver = {"solver.stepper": stepper, "solver.step": step, **own}
        self.stepper, self.tolerance = stepper, tolerance
        self._scene = changed_scene(scene, solver, stepper)
        self._every, self._times = round(EVERY / step), []
        masses = np.array(scene.balls.masses)
        self._variations = [{"balls.mass": (masses * f).tolist()} for f in FACTORS]
        self.angles = self.once()

    def once(self) -> np.ndarray:
        """Return the ball angles of all runs."""
        batch = simulate_batch(self._scene, self._variations, self._every)
        simulated = len(FACTORS) * self._scene.duration
        self._times.append(1e6 * batch.integration_seconds / simulated)
        return np.array([run.trajectory.ball_angles for run in batch.runs])

    @property
    def time(self) -> float:
        """Return the time per simulated second [us], without the first run, which compiles."""
        return float(np.median(self._times[1:]))


def settings(scene: Scene) -> Iterator[Setting]:
    """Yield all settings that the scene accepts."""
    for tolerance in TOLERANCES:
        yield Setting(scene, "taylor", EVERY, tolerance)
    for step in LADDER:
        try:
            yield Setting(scene, "rk8", step, None)
        except SceneError:  # beyond its stability limit
            continue


def measure(what: str, scene: Scene, repeats: int) -> list[dict[str, Any]]:
    """Measure one scene at all tolerances."""
    true, found = Setting(scene, "rk8", FINE, None).angles, list(settings(scene))
    for turn in range(repeats):
        for place in range(len(found)):
            found[(turn + place) % len(found)].once()
    rows, errors = [], {each: float(np.abs(each.angles - true).max()) for each in found}
    for own in found:
        if own.stepper != "taylor":
            continue
        others = [x for x in found if x.stepper != "taylor" and errors[x] <= errors[own]]
        best = min(others, key=lambda x: x.time, default=None)
        rows.append(
            {
                "scene": what,
                "tolerance": own.tolerance,
                "error": errors[own],
                "us_per_s": own.time,
                "other": best.stepper if best else None,
                "other_takes_times": best.time / own.time if best else None,
            }
        )
    return rows


def scenes(count: int) -> Iterator[tuple[str, Scene]]:
    """Yield the scenes by name."""
    for plant in PLANTS:
        for seed in range(count):
            made = scene_at_random(plant, seed, step=EVERY)
            yield plant, made.model_copy(update={"duration": 1.0})


def main() -> None:
    """Measure and write the file."""
    parser = arguments("Taylor's method in batches.", 9)
    parser.add_argument("--scenes", type=int, default=6, help="at random of each plant")
    asked, rows = parser.parse_args(), []
    for what, scene in scenes(asked.scenes):
        rows += measure(what, scene, asked.repeats)
        for row in rows[-len(TOLERANCES) :]:
            print({k: f"{v:.3g}" if isinstance(v, float) else v for k, v in row.items()})
    where = {**conditions(), "vectors": width.vectors(), "repeats": asked.repeats}
    write_json({**where, "rows": rows}, str(asked.out / "taylor-batches.json"))


if __name__ == "__main__":
    main()
