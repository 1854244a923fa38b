"""What the time of collocation is made of: spans, and iterations; and of a batch, tables.

    python benchmarks/span_cost.py [--out docs] [--repeats 21]

writes span-cost.json. How many spans and iterations a run takes is counted by a process of its
own, whose kernels count; the times are those of the package's kernels, in turns. Times for one of
each, and for what all runs have alike (1200 samples written, kinks of the profile), are the fit of
all runs' times, by least squares of what is wrong as a share; how far a run's time is from it at
most is given. With heyoka.py, its steps are beside it. The drive is that of peers.py, with output
every 5 ms.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments  # noqa: E402
from beside import heyoka_peer  # noqa: E402
from beside.case import CHANGES, SAMPLING, SCENE, VARIATIONS, Case  # noqa: E402
from beside.turns import timed  # noqa: E402
from rich.console import Console  # noqa: E402
from scipy.optimize import nnls  # noqa: E402

from ab_sim.batch import simulate_batch  # noqa: E402
from ab_sim.cli.outputs import write_json  # noqa: E402
from ab_sim.drive import Drive  # noqa: E402
from ab_sim.scene import Scene, load_scene  # noqa: E402
from ab_sim.studies.effect_cost import Spread, conditions  # noqa: E402

TOLERANCES = (1e-6, 1e-9, 1e-12)
"""rad per span."""
PEERS = {1e-6: 1e-3, 1e-9: 1e-6, 1e-12: 1e-9}
"""heyoka's tolerances that leave about as much of an error over the run, see peers.json."""
STEPS = (0, 1, 2, 3, 4, 6)
"""In a span; 0 as many as the tolerance allows."""
COUNTED = ("spans", "iterations")
"""A span is set up, judged, and its samples are evaluated, once each; beside its iterations."""
ALL_RUNS = "what all runs have alike"
ALIKE: list[dict[str, Any]] = [{"start.angle": 0.1 * i} for i in range(8)]
"""Runs of a batch whose tables are the same."""


class Setting(NamedTuple):
    """Of collocation."""

    tolerance: float
    steps: int

    @property
    def scene(self) -> Scene:
        """The drive with it."""
        return load_scene(SCENE, [
            *CHANGES,
            "solver.stepper=collocation",
            f"solver.step={SAMPLING.period}",
            f"solver.parameters.tolerance={self.tolerance}",
            f"solver.parameters.steps={self.steps}",
        ])  # fmt: skip


SETTINGS = [Setting(*each) for each in product(TOLERANCES, STEPS)]


def count() -> None:
    """Count in each setting's run, and print it as JSON; for a process of its own."""
    import numba
    from llvmlite import ir
    from numba.core import types
    from numba.extending import intrinsic

    from ab_sim.dynamics.dispatch import INLINED
    from ab_sim.integrate import span
    from ab_sim.integrate.steppers import collocation

    counts = np.zeros(len(COUNTED), np.int64)

    def counting(function: Any, which: int) -> Any:
        address = int(counts[which:].ctypes.data)

        @intrinsic
        def tick(typing_context):  # type: ignore[no-untyped-def]
            def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
                word = ir.IntType(64)
                place = builder.inttoptr(ir.Constant(word, address), word.as_pointer())
                builder.store(builder.add(builder.load(place), word(1)), place)
                return context.get_dummy_value()

            return types.none(), generate

        @numba.njit(**INLINED)
        def counted(*given):  # type: ignore[no-untyped-def]
            tick()
            return function(*given)

        return counted

    collocation.solve_span = counting(collocation.solve_span, 0)
    span.iterate = counting(span.iterate, 1)
    found = []
    for setting in SETTINGS:
        drive = Drive(setting.scene)
        counts[:] = 0
        drive.advance(SAMPLING.number)
        found.append(counts.tolist())
    print(json.dumps(found))


def counted() -> np.ndarray:
    """What ``count`` finds, and one run, shape (settings, 3)."""
    with tempfile.TemporaryDirectory() as cache:
        done = subprocess.run(
            [sys.executable, __file__, "--count"],
            env={**os.environ, "XDG_CACHE_HOME": cache},
            stdout=subprocess.PIPE,
            text=True,
            check=True,
        )
    found = np.array(json.loads(done.stdout), float)
    return np.column_stack([found, np.ones(len(found))])


class Loop:
    """A run's call of compiled code."""

    def __init__(self, setting: Setting) -> None:
        self.drive = Drive(setting.scene)
        self.samples = self.drive._room_for(SAMPLING.number)
        self.drive.reset()
        self._run()

    def __call__(self) -> float:
        """CPU time of a run [ns]."""
        for _ in range(2):  # the first finds its way into the caches
            self.drive.reset()
            seconds, _ = timed(self._run)
        return 1e9 * seconds

    def _run(self) -> None:
        self.drive._take(self.drive._way, SAMPLING.number, self.samples)


class Batch:
    """Eight runs; what of it is tables shows beside runs that share them."""

    def __init__(self, setting: Setting, variations: list[dict[str, Any]]) -> None:
        self.call = partial(simulate_batch, setting.scene, variations)
        self.call()

    def __call__(self) -> tuple[float, float]:
        """CPU time of the whole call, and of its kernels [ns a run]."""
        for _ in range(2):
            seconds, done = timed(self.call)
        return 1e9 * seconds / len(VARIATIONS), 1e9 * done.integration_seconds / len(VARIATIONS)


def peers_steps(console: Console) -> list[dict[str, Any]]:
    """How many steps heyoka takes, and of what order; none if it is not there."""
    try:
        import heyoka
    except ImportError:
        console.print(heyoka_peer.INSTALL)
        return []
    case, found = Case(), []
    for ours, tolerance in PEERS.items():
        single = heyoka_peer.Single(heyoka, case, heyoka_peer.NAME, tolerance, fast=True)
        steps = 0
        single.integrator.state[:] = case.f.start
        for grid, pars, _ in single.legs:
            single.integrator.time = grid[0]
            single.integrator.pars[:] = pars
            steps += single.integrator.propagate_grid(grid)[3]
        found.append({
            "beside": ours,
            "tolerance": tolerance,
            "order": single.integrator.order,
            "steps": steps,
            "run": single,
        })  # fmt: skip
    return found


def in_turns(runs: dict[Any, Callable[[], Any]], repeats: int) -> dict[Any, np.ndarray]:
    """Each, that many times."""
    found: dict[Any, list[Any]] = {key: [] for key in runs}
    for _ in range(repeats):
        for key, run in runs.items():
            found[key].append(run())
    return {key: np.array(values) for key, values in found.items()}


def each_twice(single: Any) -> float:
    """CPU time of the second of two runs [ns]."""
    single.once()
    seconds: float = single.once()[0]
    return 1e9 * seconds


def fit(counts: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """ns for one of each, and how far each run's time is from theirs, as a share."""
    shares = counts / times[:, None]
    each, _ = nnls(shares, np.ones(len(times)))
    return each, shares @ each - 1.0


def main() -> None:
    """Measure and write the file."""
    asked = arguments("What the time of collocation is made of.", 21).parse_args()
    console = Console(markup=False, highlight=False, soft_wrap=True)
    counts, peers = counted(), peers_steps(console)
    alone = {setting: Loop(setting) for setting in SETTINGS}
    batches = {
        (tolerance, name): Batch(Setting(tolerance, 0), variations)
        for tolerance in TOLERANCES
        for name, variations in (("masses", VARIATIONS), ("alike", ALIKE))
    }
    beside = {one["tolerance"]: partial(each_twice, one.pop("run")) for one in peers}
    took = in_turns({**alone, **batches, **beside}, asked.repeats)
    times = {setting: float(np.median(took[setting])) for setting in SETTINGS}
    each, off = fit(counts, np.array([times[setting] for setting in SETTINGS]))
    rows = []
    for setting, counted_here, wrong in zip(SETTINGS, counts, off, strict=True):
        parts = dict(zip((*COUNTED, ALL_RUNS), (counted_here * each).tolist(), strict=True))
        rows.append({
            **setting._asdict(),
            **dict(zip(COUNTED, counted_here.tolist(), strict=False)),
            "ns": Spread.of(took[setting])._asdict(),
            "parts": parts,
            "fit_is_off": wrong,
        })  # fmt: skip
        console.print(
            f"tolerance {setting.tolerance:g}, {setting.steps or 'any'} steps: "
            f"{counted_here[:-1] / SAMPLING.end} a simulated second; "
            f"{times[setting] / SAMPLING.end / 1e3:.1f} us, fit {wrong:+.1%}"
        )
    for one in peers:
        one["ns"] = Spread.of(took[one["tolerance"]])._asdict()
        console.print(
            f"heyoka, tolerance {one['tolerance']:g}: order {one['order']}, "
            f"{one['steps'] / SAMPLING.end:.1f} steps a simulated second, "
            f"{one['ns']['median'] / one['steps']:.0f} ns each"
        )
    many = []
    for tolerance in TOLERANCES:
        (whole, kernel), (_, alike) = (
            np.median(took[tolerance, name], axis=0) for name in ("masses", "alike")
        )
        loop = times[Setting(tolerance, 0)]
        many.append({
            "tolerance": tolerance,
            "loop": loop,
            "along the profile": alike - loop,
            "tables": kernel - alike,
            "the rest of the call": whole - kernel,
        })  # fmt: skip
        console.print(f"batch, ns a run: {many[-1]}")
    report = {
        **conditions(),
        "scene": SCENE,
        "changes": CHANGES,
        "duration": SAMPLING.end,
        "period": SAMPLING.period,
        "repeats": asked.repeats,
        "each_ns": dict(zip((*COUNTED, ALL_RUNS), each.tolist(), strict=True)),
        "rows": rows,
        "heyoka": peers,
        "batch": many,
    }
    report["versions"].update(heyoka_peer.versions())
    write_json(report, str(asked.out / "span-cost.json"))
    console.print(
        f"ns for one of each: {report['each_ns']}; off by {np.abs(off).max():.1%} at most"
    )


if __name__ == "__main__":
    if sys.argv[1:2] == ["--count"]:
        count()
    else:
        main()
