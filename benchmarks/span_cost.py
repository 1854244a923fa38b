"""What the time of collocation is made of: spans, and iterations; and of a batch, tables.

    python benchmarks/span_cost.py [--out docs] [--repeats 21]

writes span-cost.json. How many spans and iterations a run takes is counted by a process of its
own, whose kernels count; spans that were tried and refused are counted apart, and are among them.
The times are those of the package's kernels, in turns. Times for one of each, and for what all
runs have alike (1200 samples written, kinks of the profile), are the fit of all runs' times, by
least squares of what is wrong as a share; how far a run's time is from it at most is given. With
heyoka.py, it is beside it at the coarsest tolerance with no more error than ours. The drive is that
of peers.py, with output every 5 ms.
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

from ab_sim.accuracy.deviation import Samples  # noqa: E402
from ab_sim.batch import simulate_batch  # noqa: E402
from ab_sim.cli.outputs import write_json  # noqa: E402
from ab_sim.drive import Drive  # noqa: E402
from ab_sim.scene import Scene, load_scene  # noqa: E402
from ab_sim.studies.effect_cost import Spread, conditions  # noqa: E402

TOLERANCES = (1e-6, 1e-9, 1e-12)
"""rad per span."""
STEPS = (0, 1, 2, 3, 4, 6)
"""In a span; 0 as many as the tolerance allows."""
COUNTED = ("spans", "iterations")
"""A span is set up and judged, and unless it is refused its samples are evaluated; beside its
iterations."""
REFUSED, ALL_RUNS = "refused", "what all runs have alike"
ALIKE: list[dict[str, Any]] = [{}] * len(VARIATIONS)
"""Runs of a batch that share their tables: the first one makes them."""


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

    counts = np.zeros(len(COUNTED) + 1, np.int64)

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
    collocation.after_refusal = counting(collocation.after_refusal, 2)
    found = []
    for setting in SETTINGS:
        drive = Drive(setting.scene)
        counts[:] = 0
        drive.advance(SAMPLING.number)
        found.append(counts.tolist())
    print(json.dumps(found))


def counted() -> np.ndarray:
    """What ``count`` finds, shape (settings, 3)."""
    with tempfile.TemporaryDirectory() as cache:
        done = subprocess.run(
            [sys.executable, __file__, "--count"],
            env={**os.environ, "XDG_CACHE_HOME": cache},
            stdout=subprocess.PIPE,
            text=True,
            check=True,
        )
    return np.array(json.loads(done.stdout))


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

    def error(self, case: Case) -> float:
        """Of its samples [rad]."""
        self.drive.reset()
        return case.error(Samples.of(self.drive.advance(SAMPLING.number)))

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


def beside(case: Case, errors: dict[float, float], console: Console) -> list[dict[str, Any]]:
    """heyoka at the coarsest tolerances with no more error; none if it is not there.

    Args:
        case: the drive.
        errors: ours [rad], of each tolerance.
        console: for what is missing.
    """
    try:
        import heyoka
    except ImportError:
        console.print(heyoka_peer.INSTALL)
        return []
    found: list[dict[str, Any]] = []
    for ours, enough in errors.items():
        for tolerance in heyoka_peer.TOLERANCES:
            run = heyoka_peer.Single(heyoka, case, heyoka_peer.NAME, tolerance, fast=True)
            error = run.error(run.once()[1])
            if error <= enough:
                facts = {"beside": ours, "tolerance": tolerance, "error": error}
                facts |= {"order": run.integrator.order, "steps": steps_of(run), "run": run}
                found.append(facts)
                break
    return found


def steps_of(single: Any) -> int:
    """How many steps its run takes."""
    steps, integrator = 0, single.integrator
    integrator.state[:] = single.case.f.start
    for grid, pars, _ in single.legs:
        integrator.time = grid[0]
        integrator.pars[:] = pars
        steps += integrator.propagate_grid(grid)[3]
    return steps


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


def parts_of(loop: float, masses: np.ndarray, alike: np.ndarray) -> dict[str, float]:
    """What a run in a batch takes its time for [ns].

    Args:
        loop: of a run alone.
        masses: of each run with tables of its own, the whole call and its kernel.
        alike: where the first of eight makes the tables of all.
    """
    kernel, shared = masses[1], alike[1]
    tables = (kernel - shared) * len(VARIATIONS) / (len(VARIATIONS) - 1)
    rest = kernel - loop - tables
    parts = {"a run alone": loop, "tables": tables, "beside them, in the kernel's calls": rest}
    return {**parts, "the rest of the whole call": masses[0] - kernel}


def main() -> None:
    """Measure and write the file."""
    asked = arguments("What the time of collocation is made of.", 21).parse_args()
    console = Console(markup=False, highlight=False, soft_wrap=True)
    case, counts = Case(), counted()
    alone = {setting: Loop(setting) for setting in SETTINGS}
    errors = {of: alone[Setting(of, 0)].error(case) for of in TOLERANCES}
    peers = beside(case, errors, console)
    batches = {
        (tolerance, name): Batch(Setting(tolerance, 0), variations)
        for tolerance in TOLERANCES
        for name, variations in (("masses", VARIATIONS), ("alike", ALIKE))
    }
    others = {one["beside"]: partial(each_twice, one.pop("run")) for one in peers}
    took = in_turns({**alone, **batches, **others}, asked.repeats)
    times = np.array([np.median(took[setting]) for setting in SETTINGS])
    done = np.column_stack([counts[:, : len(COUNTED)], np.ones(len(counts))])
    each, off = fit(done, times)
    names, rows = (*COUNTED, ALL_RUNS), []
    for setting, found, parts, wrong in zip(SETTINGS, counts, done * each, off, strict=True):
        rows.append({
            **setting._asdict(),
            **dict(zip((*COUNTED, REFUSED), found.tolist(), strict=True)),
            "ns": Spread.of(took[setting])._asdict(),
            "parts": dict(zip(names, parts.tolist(), strict=True)),
            "fit_is_off": wrong,
        })  # fmt: skip
        if setting.tolerance in errors and setting.steps == 0:
            rows[-1]["error"] = errors[setting.tolerance]
        console.print(
            f"tolerance {setting.tolerance:g}, {setting.steps or 'any'} steps: {found} "
            f"{(*COUNTED, REFUSED)}, {rows[-1]['ns']['median'] / 1e3:.1f} us, fit {wrong:+.1%}"
        )
    for one in peers:
        one["ns"] = Spread.of(took[one["beside"]])._asdict()
        console.print(f"heyoka: {one}")
    many = []
    for tolerance in TOLERANCES:
        masses, alike = (np.median(took[tolerance, name], axis=0) for name in ("masses", "alike"))
        loop = float(np.median(took[Setting(tolerance, 0)]))
        many.append({"tolerance": tolerance, **parts_of(loop, masses, alike)})
        console.print(f"batch, ns a run: {many[-1]}")
    report = {
        **conditions(),
        "scene": SCENE,
        "changes": CHANGES,
        "duration": SAMPLING.end,
        "period": SAMPLING.period,
        "repeats": asked.repeats,
        "each_ns": dict(zip(names, each.tolist(), strict=True)),
        "rows": rows,
        "heyoka": peers,
        "batch": many,
    }
    report["versions"].update(heyoka_peer.versions())
    write_json(report, str(asked.out / "span-cost.json"))
    most = np.abs(off).max()
    console.print(f"ns for one of each: {report['each_ns']}; off by {most:.1%} at most")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--count"]:
        count()
    else:
        main()
