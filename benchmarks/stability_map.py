"""How long a map of stability takes, with its borders refined.

    python benchmarks/stability_map.py [--out docs] [--repeats 1]

prints times and counts and writes stability-map.png: `nsc-case-3` with two heavy balls, and with
three that are together as heavy, over speed and damping of the suspension, 200 by 200 points each,
by as many processes as there are processors where it takes long. Nothing is taken from what earlier
runs have kept. The goal is a minute for a map on two processors; kernels are compiled before.
"""

import os
import resource
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments  # noqa: E402

from ab_sim.analysis import results  # noqa: E402
from ab_sim.analysis.maps.balls import BallCountComparison, plane_with_balls  # noqa: E402
from ab_sim.analysis.maps.plane import Plane, axes_of  # noqa: E402
from ab_sim.analysis.maps.stability import COARSE, StabilityMap, label_at, stability_map  # noqa: E402
from ab_sim.scene import load_scene  # noqa: E402
from ab_sim.studies.effect_cost import conditions  # noqa: E402

SCENE, CHANGES = "nsc-case-3", ("balls.mass=0.0006", "effects.viscous_drag.coefficient=0.008")
"""Balls that are together twice as heavy as would balance, and hardly dragged: borders are long."""
AXES = "speed=100:600:200,effects.suspension.damping=2:160:200"
OTHER = 3
GOAL = 60.0
"""s."""


def timed(plane: Plane, workers: int) -> tuple[StabilityMap, float, float]:
    """A map, its wall time, and the processors' time that its processes took [s]."""
    with tempfile.TemporaryDirectory() as folder:
        results.results_folder = lambda: Path(folder)  # type: ignore[assignment]
        begin, before = time.perf_counter(), _used()
        found = stability_map(plane, COARSE, workers)
        return found, time.perf_counter() - begin, _used() - before


def _used() -> float:
    """Processors' time of this process and those that it has started and seen end [s]."""
    parts = map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(part.ru_utime + part.ru_stime for part in parts)


def main() -> None:
    """Measure, print, draw."""
    told = arguments(__doc__.splitlines()[0], 1).parse_args()
    workers = len(os.sched_getaffinity(0))
    plane = Plane(load_scene(SCENE, CHANGES), 0.0, *axes_of(AXES))
    print(f"{workers} processes; {conditions()}")
    maps = []
    for each in (plane, plane_with_balls(plane, OTHER)):
        label_at(each, (0, 0))  # compiles
        runs = [timed(each, workers) for _ in range(told.repeats)]
        found, seconds, used = min(runs, key=lambda run: run[1])
        computed = int(found.computed.sum())
        verdict = "within" if seconds < GOAL else "beyond"
        print(
            f"{each.scene.balls.count} balls: {seconds:.1f} s ({verdict} the goal of {GOAL:g} s), "
            f"{computed} of {found.labels.size} points computed, "
            f"{used:.1f} s of the processors"
        )
        maps.append(found)
    against = BallCountComparison(*maps)
    print(f"at some position: {against.somewhere}\nat every position: {against.everywhere}")
    from ab_sim.figures.stability_map import map_figure  # processes need not import it

    map_figure(maps[0], told.out / "stability-map.png", maps[1])


if __name__ == "__main__":
    main()
