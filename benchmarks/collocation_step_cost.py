"""What the time of collocation is made of: spans, and iterations; and of a batch, tables.

    python benchmarks/collocation_step_cost.py [--out docs] [--repeats 21]

writes span-cost.json. How many spans and iterations a run takes is counted in a run that calls the
scene's functions through others, which count; spans that were tried and refused are counted apart,
and are among them. The times are those of runs without such, in turns. Times for one of each, and
for what all runs have alike (1200 samples written, kinks of the profile), are the fit of all runs'
times with so many nodes, by least squares of what is wrong as a share; how far a run's time is from
it at most is given. With heyoka.py, it is beside it at the coarsest tolerance with no more error
than ours. The drive is that of peers.py, with output every 5 ms.
"""

import ctypes
import sys
from collections import Counter
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
from ab_sim.collocation.assemble import ByCollocation  # noqa: E402
from ab_sim.drive import Drive  # noqa: E402
from ab_sim.integrate.steppers.collocation import collocation, setting_for  # noqa: E402
from ab_sim.kernels.code import caller  # noqa: E402
from ab_sim.scene import Scene, load_scene  # noqa: E402
from ab_sim.studies.effect_cost import Quartiles, conditions  # noqa: E402

TOLERANCES = (1e-6, 1e-9, 1e-12)
"""rad per span."""
STEPS = (0, 1, 2, 3, 4, 6)
"""In a span; 0 as many as the tolerance allows."""
COUNTED = ("spans", "iterations")
"""A span is set up and judged, and unless it is refused its samples are evaluated; beside its
iterations."""
EMITTED = {"start": (12, 3), "iterate": (7, 0), "iterate_near": (7, 0), "keep": (4, 0)}
"""Functions that are counted, with how many pointers and numbers they take."""
REFUSED, ALL_RUNS = "refused", "what all runs have alike"
ALIKE: list[dict[str, Any]] = [{}] * len(VARIATIONS)
"""Runs of a batch that share their tables: the first one makes them."""


class Setting(NamedTuple):
    """Of collocation."""

    tolerance: float
    steps: int

    @property
    def nodes(self) -> int:
        """Of its spans."""
        return setting_for(collocation(self.tolerance, self.steps, 0.0).weights, True).nodes

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


def counted() -> np.ndarray:
    """How many of ``COUNTED`` and REFUSED there are in each setting's run, shape (settings, 3).

    The functions that are emitted for a scene are called through others, which count.
    """
    found, plain = [], ByCollocation.along
    calls: Counter[str] = Counter()
    alive: list[Any] = []

    def counting(name: str, address: int, pointers: int, numbers: int) -> int:
        kind = caller(pointers, numbers)
        function = kind(address)

        def counted(*given: Any) -> None:
            calls[name] += 1
            function(*given)

        alive.append(kind(counted))
        return int(ctypes.cast(alive[-1], ctypes.c_void_p).value or 0)

    def along(self: ByCollocation, *given: Any) -> Any:
        own = plain(self, *given)
        changed = {
            name: counting(name, getattr(own.functions, name), *shape)
            for name, shape in EMITTED.items()
        }
        return own._replace(functions=own.functions._replace(**changed))

    ByCollocation.along = along  # type: ignore[method-assign]
    try:
        for setting in SETTINGS:
            drive = Drive(setting.scene)
            calls.clear()
            drive.advance(SAMPLING.number)
            iterations = calls["iterate"] + calls["iterate_near"]
            found.append([calls["start"], iterations, calls["start"] - calls["keep"]])
    finally:
        ByCollocation.along = plain  # type: ignore[method-assign]
    return np.array(found)


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
    spread: dict[str, float] = Quartiles.of(1e9 * SAMPLING.end * np.array(run.times))._asdict()
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
    nodes = np.array([setting.nodes for setting in SETTINGS])
    each, off, in_parts = {}, np.zeros(len(times)), np.zeros(done.shape)
    for count in np.unique(nodes):
        alike = nodes == count
        each[int(count)], off[alike] = fit(done[alike], times[alike])
        in_parts[alike] = done[alike] * each[int(count)]
    names, rows = (*COUNTED, ALL_RUNS), []
    for setting, found, parts, wrong in zip(SETTINGS, counts, in_parts, off, strict=True):
        rows.append({
            **setting._asdict(),
            "nodes": setting.nodes,
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
        "each_ns": {
            count: dict(zip(names, ns_each.tolist(), strict=True))
            for count, ns_each in each.items()
        },
        "rows": rows,
        "heyoka": heyoka,
        "batch": many,
    }
    report["versions"].update(heyoka_peer.versions())
    write_json(report, str(asked.out / "span-cost.json"))
    most = np.abs(off).max()
    console.print(f"ns for one of each: {report['each_ns']}; off by {most:.1%} at most")


if __name__ == "__main__":
    main()
