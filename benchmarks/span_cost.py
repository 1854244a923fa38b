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
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments  # noqa: E402
from beside import heyoka_peer, ours  # noqa: E402
from beside.case import CHANGES, CONDITIONS, SAMPLING, SCENE, VARIATIONS, Case  # noqa: E402
from beside.turns import Candidate, take_turns, timed  # noqa: E402
from rich.console import Console  # noqa: E402
from scipy.optimize import nnls  # noqa: E402

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


def alone(case: Case, setting: Setting) -> Candidate:
    """The compiled loop of one run."""
    return Candidate(partial(ours.Loop, case, "collocation", str(setting), setting.scene))


def beside(case: Case, errors: dict[float, float], console: Console) -> dict[float, Candidate]:
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
        return {}
    made = partial(heyoka_peer.Single, heyoka, case, heyoka_peer.NAME, fast=True)
    found = {}
    for of, enough in errors.items():
        tried = (Candidate(partial(made, tolerance)) for tolerance in heyoka_peer.TOLERANCES)
        fit_for_it = next((each for each in tried if each.error <= enough), None)
        if fit_for_it is not None:
            found[of] = fit_for_it
    return found


def in_turns(batches: dict[Any, Batch], repeats: int) -> dict[Any, np.ndarray]:
    """Medians of each [ns a run]."""
    took = [{key: batch() for key, batch in batches.items()} for _ in range(repeats)]
    return {key: np.median([turn[key] for turn in took], axis=0) for key in batches}


def fit(counts: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """ns for one of each, and how far each run's time is from theirs, as a share."""
    shares = counts / times[:, None]
    each, _ = nnls(shares, np.ones(len(times)))
    return each, shares @ each - 1.0


def ns(run: Candidate) -> dict[str, float]:
    """CPU time of a whole run [ns]."""
    spread: dict[str, float] = Spread.of(1e9 * SAMPLING.end * np.array(run.times))._asdict()
    return spread


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
    runs = {setting: alone(case, setting) for setting in SETTINGS}
    peers = beside(case, {of: runs[Setting(of, 0)].error for of in TOLERANCES}, console)
    batches = {
        (tolerance, name): Batch(Setting(tolerance, 0), variations)
        for tolerance in TOLERANCES
        for name, variations in (("masses", VARIATIONS), ("alike", ALIKE))
    }
    take_turns([*runs.values(), *peers.values()], asked.repeats)
    in_batches = in_turns(batches, asked.repeats)
    times = np.array([ns(run)["median"] for run in runs.values()])
    done = np.column_stack([counts[:, : len(COUNTED)], np.ones(len(counts))])
    each, off = fit(done, times)
    names, rows = (*COUNTED, ALL_RUNS), []
    for setting, found, parts, wrong in zip(SETTINGS, counts, done * each, off, strict=True):
        rows.append({
            **setting._asdict(),
            **dict(zip((*COUNTED, REFUSED), found.tolist(), strict=True)),
            "error": runs[setting].error,
            "ns": ns(runs[setting]),
            "parts": dict(zip(names, parts.tolist(), strict=True)),
            "fit_is_off": wrong,
        })  # fmt: skip
        console.print(
            f"tolerance {setting.tolerance:g}, {setting.steps or 'any'} steps: {found} "
            f"{(*COUNTED, REFUSED)}, {rows[-1]['ns']['median'] / 1e3:.1f} us, fit {wrong:+.1%}"
        )
    heyoka = [
        {"beside": of, "tolerance": run.of.integrator.tol, "error": run.error,
         "order": run.of.integrator.order, "steps": run.of.steps, "ns": ns(run)}
        for of, run in peers.items()
    ]  # fmt: skip
    console.print(f"heyoka: {heyoka}")
    many = []
    for tolerance in TOLERANCES:
        masses, alike = (in_batches[tolerance, name] for name in ("masses", "alike"))
        loop = ns(runs[Setting(tolerance, 0)])["median"]
        many.append({"tolerance": tolerance, **parts_of(loop, masses, alike)})
        console.print(f"batch, ns a run: {many[-1]}")
    report = {
        **conditions(),
        **CONDITIONS,
        "repeats": asked.repeats,
        "each_ns": dict(zip(names, each.tolist(), strict=True)),
        "rows": rows,
        "heyoka": heyoka,
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
