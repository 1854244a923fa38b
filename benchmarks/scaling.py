"""What it costs to share a sweep: per task, per run and per worker, over processes and Dask.

    python benchmarks/scaling.py [--out docs] [--repeats 5]

writes scale.json and scale.md. All that is compared takes turns. Schedulers and workers are
processes of this machine, reached over loopback.

Tasks: calls that hand back the rows of one run, and of 4,096, without running them; two workers.
Waiting: calls that wait a quarter of a second, eight for each worker: how much longer it takes than
these two seconds does not depend on how many processors are free, as runs do.
Throughput: `balanced-start-up` over mass and drag, in chunks, with one and two workers that have
their kernels; beside them processes that share nothing, and have their runs from the beginning:
what the processors give. A new worker: from its start to a first chunk of eight runs, and to a
second one.
"""

import functools
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from arguments import arguments  # noqa: E402
from scaling_page import APART, DASK, LOCAL, page  # noqa: E402

from ab_sim import workers as local_workers  # noqa: E402
from ab_sim.analysis import results  # noqa: E402
from ab_sim.design.cluster import Cluster  # noqa: E402
from ab_sim.design.judged import Job, Point, judged  # noqa: E402
from ab_sim.design.parts import Parts  # noqa: E402
from ab_sim.design.points import points_of  # noqa: E402
from ab_sim.design.sweep import DEFAULT_MERITS  # noqa: E402
from ab_sim.design.variables import variable_of  # noqa: E402
from ab_sim.design.work import Executor  # noqa: E402
from ab_sim.scene import load_scene  # noqa: E402
from ab_sim.studies.effect_cost import Quartiles, conditions  # noqa: E402
from ab_sim.workers import Workers  # noqa: E402
from benchmarks.unrun import unrun, wait_for  # noqa: E402
from tests.design.dask_cluster import DaskCluster  # noqa: E402

SCENE = "balanced-start-up"
OVER = ("balls.mass=0.5 g..3 g", "effects.viscous_drag.coefficient=log:0.1..10")
TASKS = {1: 500, 4096: 24}
"""Rows that a task hands back, and how many tasks of that size."""
CHUNK, CHUNKS = 64, 10
"""Runs of a chunk; chunks of a sweep."""
COUNTS = (1, 2)
WAIT, WAITS, WAITING = 0.25, 8, (1, 2, 4)
"""s that a call waits; how many calls for each worker; how many workers."""


def job_and_points(runs: int) -> tuple[Job, list[Point]]:
    """A sweep, and so many of its points."""
    points = points_of([variable_of(text) for text in OVER], f"lhs:{runs}")
    values = [Point(run, points.at(run)) for run in range(runs)]
    return Job(load_scene(SCENE), points.keys, DEFAULT_MERITS), values


@contextmanager
def executors(folder: Path, count: int) -> Iterator[tuple[dict[str, Executor], int]]:
    """Processes, and workers of Dask with the number of their scheduler."""
    local_workers.TRIAL = local_workers.WORTH_IT = 0.0  # processes share the work at once
    with (
        DaskCluster(folder, count) as cluster,
        Workers(count) as processes,
        Cluster(cluster.address) as dask,
    ):
        yield {LOCAL: processes, DASK: dask}, cluster.scheduler.pid


def cpu_of(process: int) -> float:
    """Processor's time that a process has had [s]."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def tasks(folder: Path, repeats: int) -> list[dict[str, Any]]:
    """What a task costs, by its size and by who does it; all in turns."""
    measured: dict[tuple[str, int], dict[str, list[float]]] = {}
    with executors(folder, 2) as (each, scheduler):
        for repeat in range(-1, repeats):
            for rows, count in TASKS.items():
                for name, executor in each.items():
                    found = task_cost(executor, scheduler, rows, count if repeat >= 0 else 8)
                    if repeat >= 0:  # the first time connects and imports
                        into = measured.setdefault((name, rows), {})
                        for what, seconds in found.items():
                            into.setdefault(what, []).append(seconds)
    return [
        {"executor": name, "rows": rows, **spreads(found)}
        for (name, rows), found in measured.items()
    ]


def task_cost(executor: Executor, scheduler: int, rows: int, count: int) -> dict[str, float]:
    """Of one of many tasks of so many rows [s]."""
    job, points = job_and_points(rows)
    before = time.process_time(), cpu_of(scheduler)
    begin = time.perf_counter()
    for _ in executor.each(functools.partial(unrun, job), [points] * count, chunk=1):
        pass
    spent = {
        "wall": time.perf_counter() - begin,
        "client_cpu": time.process_time() - before[0],
        "scheduler_cpu": cpu_of(scheduler) - before[1],
    }
    return {what: seconds / count for what, seconds in spent.items()}


def job_and_chunks() -> tuple[Job, list[list[Point]]]:
    """The sweep of ``throughput``, and its points in chunks."""
    job, points = job_and_points(CHUNK * CHUNKS)
    return job, [points[first : first + CHUNK] for first in range(0, len(points), CHUNK)]


def throughput(folder: Path, repeats: int) -> list[dict[str, Any]]:
    """Runs per second, by workers; and to one worker of the same kind, repeat by repeat."""
    job, chunks = job_and_chunks()
    rates: dict[tuple[str, int], list[float]] = {}
    places = [folder / str(count) for count in COUNTS]
    for place in places:
        place.mkdir()
    with (
        executors(places[0], COUNTS[0]) as one,
        executors(places[1], COUNTS[1]) as two,
        processes_apart() as apart,
    ):
        every = {
            (name, count): executor
            for count, (found, _) in zip(COUNTS, (one, two), strict=True)
            for name, executor in found.items()
        }
        tables = []
        for there in apart.values():
            time_apart(there)  # compiles
        for repeat in range(-1, repeats):
            for count, there in apart.items() if repeat >= 0 else ():
                rates.setdefault((APART, count), []).append(CHUNK * CHUNKS / time_apart(there))
            for which, executor in every.items():
                begin = time.perf_counter()
                rows = list(executor.each(functools.partial(judged, job), chunks, chunk=1))
                if repeat >= 0:
                    rates.setdefault(which, []).append(
                        CHUNK * CHUNKS / (time.perf_counter() - begin)
                    )
                else:  # compiles, and looks at the rows
                    tables.append(pyarrow.concat_tables(rows))
        assert all(table.equals(tables[0]) for table in tables), "not the same bits"
    found = []
    for (name, count), values in rates.items():
        ratio = np.array(values) / np.array(rates[name, COUNTS[0]])
        said = {"runs_per_second": values, "of_one_worker": ratio}
        found.append({"executor": name, "workers": count, **spreads(said)})
    return found


@contextmanager
def processes_apart() -> Iterator[dict[int, list[subprocess.Popen[str]]]]:
    """By how many share the runs of ``throughput``: processes that wait for a line."""
    started = {
        count: [
            subprocess.Popen(
                [sys.executable, __file__, "--apart", str(place), str(count)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
            for place in range(count)
        ]
        for count in COUNTS
    }
    try:
        yield started
    finally:
        for process in (process for group in started.values() for process in group):
            process.communicate()


def time_apart(group: list[subprocess.Popen[str]]) -> float:
    """Until all of them have done their runs [s]."""
    begin = time.perf_counter()
    for process in group:
        assert process.stdin is not None
        process.stdin.write("go\n")
        process.stdin.flush()
    for process in group:
        assert process.stdout is not None
        assert process.stdout.readline() == "done\n"
    return time.perf_counter() - begin


def run_apart(place: int, count: int) -> None:
    """Each time that a line comes, do this process' share of the runs of ``throughput``."""
    job, chunks = job_and_chunks()
    for _ in sys.stdin:
        for chunk in chunks[place::count]:
            judged(job, chunk)
        print("done", flush=True)


def waiting(folder: Path, repeats: int) -> list[dict[str, Any]]:
    """What share of their time workers that wait are at it."""
    found: dict[tuple[str, int], list[float]] = {}
    for count in WAITING:
        place = folder / str(count)
        place.mkdir()
        with executors(place, count) as (each, _):
            for executor in each.values():  # connects and imports
                list(executor.each(functools.partial(wait_for, WAIT), range(4 * count), 1))
            for _ in range(repeats):
                for name, executor in each.items():
                    items = range(WAITS * count)
                    begin = time.perf_counter()
                    list(executor.each(functools.partial(wait_for, WAIT), items, chunk=1))
                    share = WAITS * WAIT / (time.perf_counter() - begin)
                    found.setdefault((name, count), []).append(share)
    return [
        {"executor": name, "workers": count, **spreads({"share": shares})}
        for (name, count), shares in found.items()
    ]


def client(folder: Path, repeats: int) -> dict[str, Any]:
    """What this process does for a run beside its task: its point, its row on disk [CPU s]."""
    results.results_folder = lambda: folder  # type: ignore[assignment]
    rows, found = max(TASKS), []
    points = points_of([variable_of(text) for text in OVER], f"lhs:{rows}")
    job, made = job_and_points(rows)
    table = unrun(job, made)
    for repeat in range(repeats):
        with Parts(job, {"repeat": repeat}) as parts:
            begin = time.process_time()
            for run in range(rows):
                Point(run, points.at(run))
            parts.keep(table)
            found.append((time.process_time() - begin) / rows)
    return spreads({"cpu_per_run": found})


def spreads(found: dict[str, Any]) -> dict[str, Any]:
    """Quartiles of all."""
    return {name: Quartiles.of(np.array(values))._asdict() for name, values in found.items()}


def new_worker() -> dict[str, float]:
    """In a process that has just begun: what its first chunks take, of which kernels are a part."""
    begin = time.perf_counter(), time.process_time()
    from ab_sim.tracing.machine_code import MachineCode

    code = [0.0]
    make = MachineCode.__init__

    def timed(self: Any, *given: Any, **named: Any) -> None:
        began = time.process_time()
        make(self, *given, **named)
        code[0] += time.process_time() - began

    MachineCode.__init__ = timed  # type: ignore[method-assign]
    job, points = job_and_points(8)
    found = {"ready": time.process_time()}
    for name in ("first_chunk", "second_chunk"):
        began = time.process_time()
        judged(job, points)
        found[name] = time.process_time() - began
    return {**found, "machine_code": code[0], "wall": time.perf_counter() - begin[0]}


def new_workers(repeats: int) -> dict[str, Any]:
    """Each in a process of its own."""
    measured: dict[str, list[float]] = {}
    for _ in range(repeats):
        done = subprocess.run(
            [sys.executable, __file__, "--child"], stdout=subprocess.PIPE, check=True
        )
        for name, value in json.loads(done.stdout).items():
            measured.setdefault(name, []).append(value)
    return spreads(measured)


def main() -> None:
    """Measure all, and write."""
    asked = arguments(__doc__ or "", repeats=5).parse_args()
    report: dict[str, Any] = {**conditions(), "clock": "wall time", "repeats": asked.repeats}
    parts: dict[str, Callable[[Path], Any]] = {
        "tasks": lambda folder: tasks(folder, asked.repeats),
        "waiting": lambda folder: waiting(folder, asked.repeats),
        "throughput": lambda folder: throughput(folder, asked.repeats),
        "client": lambda folder: client(folder, asked.repeats),
        "new_worker": lambda folder: new_workers(asked.repeats),
    }
    for name, measure in parts.items():
        with tempfile.TemporaryDirectory() as folder:
            begin = time.perf_counter()
            report[name] = measure(Path(folder))
            print(f"{name}: {time.perf_counter() - begin:.0f} s", file=sys.stderr)
    report["chunk"], report["scene"] = CHUNK, SCENE
    report["machine"]["load_average_at_the_end"] = list(os.getloadavg())
    (asked.out / "scale.json").write_text(json.dumps(report, indent=1) + "\n")
    (asked.out / "scale.md").write_text(page(report))
    print(asked.out / "scale.md")


if __name__ == "__main__":
    if sys.argv[1:] == ["--child"]:
        print(json.dumps(new_worker()))
    elif sys.argv[1:2] == ["--apart"]:
        run_apart(*map(int, sys.argv[2:]))
    else:
        main()
