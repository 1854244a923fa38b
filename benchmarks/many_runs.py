"""CPU time of 10,000 runs on two cores, from their parameters to a metric, next to heyoka.

    pip install heyoka
    python benchmarks/many_runs.py [--out docs] [--repeats 5] [--runs 10000]

writes many-runs.json. The runs are the thesis' start-up with a hold, 6 s, two balls, no friction,
with different masses of the balls. The metric is the largest whirl, from samples every 5 ms. Each
program gets an array of masses and returns an array of metrics, and uses two threads, each with
half of the runs:

- `simulate_batch`, as users call it, with its checks;
- heyoka's `taylor_adaptive_batch`, one compiled integrator per thread, which gets start and
  parameters of eight runs at a time. `ensemble_propagate_grid_batch` copies the integrator for
  each call instead, which takes longer.

Code is compiled before; "first" is the CPU time of compiling and of the first eight runs. Each
method has its coarsest setting with a small enough error in ball angle, over eight masses. All are
measured in turns. The metrics of all programs must agree. "Own scenes" is the time of runs for
which a key varies that needs a separate scene for each run, relative to that of others.
"""

import copy
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments  # noqa: E402
from beside import heyoka_peer, ours, width  # noqa: E402
from beside.case import CHANGES, SCENE, VARIATIONS, BatchCase  # noqa: E402
from beside.turns import Candidate, candidates  # noqa: E402

from ab_sim.analysis.effect_cost import Quartiles, conditions  # noqa: E402
from ab_sim.cli.outputs import write_json  # noqa: E402
from ab_sim.design.batch import simulate_batch  # noqa: E402
from ab_sim.scene import Scene  # noqa: E402

WANTED, THREADS, METRIC = (1e-6, 1e-9, 1e-12), 2, "peak_whirl_over_e"
FINER = tuple(10.0 ** (-k / 2) for k in range(6, 28))
"""Tolerances; peers.py has every second one and interpolates."""
AGREE = 1e-4
"""Largest relative difference of the metrics of two programs."""
Call = Callable[[np.ndarray], np.ndarray]


def by_batch(scene: Scene) -> Call:
    """Return a function from masses to metrics by ``simulate_batch``."""
    return lambda masses: simulate_batch(scene, {"balls.mass": masses}, metrics=[METRIC]).metrics[
        METRIC
    ]


def by_heyoka(group: heyoka_peer.Group, case: BatchCase) -> Call:
    """Return a function from masses to metrics by a compiled integrator, for one call at a time."""
    scene, legs, lanes = case.with_solver(), case.runs[0].legs, width.lanes()

    def call(masses: np.ndarray) -> np.ndarray:
        balls = scene.balls.model_copy(update={"mass": masses})
        varied = scene.model_copy(update={"balls": balls})
        k, ramps = (
            heyoka_peer.Constants.of(varied),
            (heyoka_peer.OnRamp.of(varied, x) for x in legs),
        )
        pars = [np.array(np.broadcast_arrays(*ramp, *k, masses)[:-1]) for ramp in ramps]
        peaks, grids = np.empty(masses.size), group.legs
        for first in range(0, masses.size, lanes):
            runs = slice(first, first + lanes)
            group.legs = [(x[0], p[:, runs], x[2]) for x, p in zip(grids, pars, strict=True)]
            states = np.concatenate(group.run())
            peaks[runs] = np.hypot(states[:, 0], states[:, 1]).max(axis=0)
        group.legs = grids
        return peaks / scene.rotor.eccentricity

    return call


def calls_of(setting: Candidate, case: BatchCase) -> list[Call]:
    """Return one function per thread."""
    if setting.of.ours:
        return [by_batch(setting.of.scene)] * THREADS
    groups = [copy.copy(setting.of.groups[0]) for _ in range(THREADS)]
    for group in groups:
        group.integrator = copy.deepcopy(group.integrator)
    return [by_heyoka(group, case) for group in groups]


def timed(calls: list[Call], masses: np.ndarray) -> tuple[float, np.ndarray]:
    """Return the CPU time of all threads per run [s], and the metrics."""
    parts, begin = np.split(masses, THREADS), time.process_time()
    with ThreadPoolExecutor(THREADS) as pool:
        metrics = np.concatenate([*pool.map(lambda call, x: call(x), calls, parts)])
    return (time.process_time() - begin) / masses.size, metrics


def compare(repeats: int, runs: int) -> list[dict[str, Any]]:
    """Measure the methods at all errors."""
    case, ours.TOLERANCES, heyoka_peer.TOLERANCES = BatchCase(), FINER, FINER
    own_names = [name + ours.KERNEL for name in ("rk8", "taylor")]
    families = [x for x in ours.batch_families(case) if x[0] in own_names]
    families.append(heyoka_peer.batch_families(case)[1])  # with fast_math
    found, _ = candidates(families, print)
    masses = np.linspace(VARIATIONS[0]["balls.mass"], VARIATIONS[-1]["balls.mass"], runs)
    rows = []
    for wanted in WANTED:
        fit = [each for each in found if each.error <= wanted]
        coarsest = {
            x.of.method.removesuffix(ours.KERNEL): x for x in sorted(fit, key=lambda x: x.error)
        }
        calls = {name: calls_of(x, case) for name, x in coarsest.items()}
        for each in calls.values():  # compiles what is not there yet
            timed(each, masses[: THREADS * width.lanes()])
        times: dict[str, list[float]] = {name: [] for name in calls}
        for _ in range(repeats):
            metrics = {}
            for name, each in calls.items():
                seconds, metrics[name] = timed(each, masses)
                times[name].append(seconds)
            first, *others = metrics.values()
            assert all(np.allclose(first, other, rtol=AGREE, atol=0.0) for other in others)
        own, peer = (
            min((n for n in calls if coarsest[n].of.ours is x), key=lambda n: np.median(times[n]))
            for x in (True, False)
        )
        ratio = Quartiles.of(np.array(times[peer]) / np.array(times[own]))
        print(f"{wanted:g} rad: {peer} takes {ratio.median:.2f} times as long as {own}")
        methods = [
            {
                "method": name,
                "setting": coarsest[name].of.setting,
                "error": coarsest[name].error,
                "first": coarsest[name].first,
                "seconds_per_run": Quartiles.of(np.array(times[name]))._asdict(),
            }
            for name in calls
        ]
        best = {"ours": own, "peer": peer, "ratio": ratio._asdict()}
        rows.append({"error": wanted, **best, "methods": methods})
    return rows


def own_scenes(repeats: int, runs: int) -> dict[str, float]:
    """Measure runs with separate scenes, relative to others."""
    scene, ratios = BatchCase().with_solver("solver.step=0.005"), []
    masses, speeds = np.linspace(0.9e-3, 1.1e-3, runs), np.linspace(0.0, 1.0, runs)
    for _ in range(repeats + 1):  # the first one compiles
        begin = time.process_time()
        simulate_batch(scene, {"balls.mass": masses}, metrics=[METRIC])
        middle = time.process_time()
        simulate_batch(scene, {"balls.mass": masses, "start.speed": speeds}, metrics=[METRIC])
        ratios.append((time.process_time() - middle) / (middle - begin))
    return Quartiles.of(np.array(ratios[1:]))._asdict()


def main() -> None:
    """Measure and write the file."""
    parser = arguments("Many runs next to heyoka.", 5)
    parser.add_argument("--runs", type=int, default=10_000, help="of a call; divisible by 16")
    asked = parser.parse_args()
    where = {**conditions(), "scene": SCENE, "changes": CHANGES, "runs": asked.runs}
    where["versions"].update(heyoka_peer.versions())
    where |= {"clock": "CPU time of the process", "repeats": asked.repeats}
    where |= {"vectors": width.vectors(), "threads": THREADS, "metric": METRIC}
    rows = compare(asked.repeats, asked.runs)
    report = {**where, "rows": rows, "own_scenes": own_scenes(asked.repeats, asked.runs // 10)}
    write_json(report, str(asked.out / "many-runs.json"))


if __name__ == "__main__":
    main()
