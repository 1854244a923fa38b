"""The page of scale.json: docs/scale.md. Each of its figures is read or computed here."""

import math
from typing import Any

from page_parts import conditions, spread, table

from ab_sim.design.work import CHUNK_SECONDS

LOCAL, DASK, APART = "processes", "Dask", "nothing shared"
"""Who shares the work."""
HOSTS, CORES = 100, 32
"""Of the plan."""
SHARE = 0.25
"""Of what scheduler and client can do at most, that the plan asks of each."""
HEAD = """# Work on many machines

Written by `python benchmarks/scaling.py`; do not edit. No figure here is typed in.

`ab-sim sweep` shares its runs among processes of this machine (`--workers`). With `--scheduler` the
workers of a [Dask](https://distributed.dask.org) cluster that is there already do the same work:

```text
pip install 'ab_sim[cluster]'                                  # on every machine
dask scheduler --host 10.0.0.1 --port 8786                     # on one
dask worker tcp://10.0.0.1:8786 --nworkers -1 --nthreads 1     # on each: a process for each core
```

```bash
.venv/bin/ab-sim sweep thesis-hold --over balls.mass=0.001..0.003:99999 --scheduler tcp://10.0.0.1:8786
```

In Python, `ab_sim.sweep(..., scheduler="tcp://10.0.0.1:8786")`. `tune`, `robust`
and `size` take it, too.

- **The same bits.** A row is what a single run gives, whoever computes it. Before it does anything
  a worker compares its sources, its Python and its packages with those of the process that asks,
  and one that differs is refused; the error names what differs. Processors need not be alike: [any
  x86-64 processor with AVX2 and FMA](core.md#same-bits) gives the same bits. `pip install -c
  constraints.txt` gives each machine the same versions.
- **First some runs here**, a fifth of a second's work, to see how long they take. What is done by
  then, as a hundred short runs, asks no scheduler, and does not notice that there is none.
- **A worker that is killed** is made up for by others. A call that has ended four workers is given
  up.
- **A scheduler that is lost** ends the command, with code 1. What is done is kept on the machine
  that asked; the same command goes on, with a scheduler or without one.
- **Ctrl-C** takes back what has not begun. What a worker is at, it ends, and nobody hears of it.
- **No workers yet**: the command waits for some, and says so. Workers may come and go.
- **Effects and merits of your own**: their modules have to be importable on the workers, which
  import them.
- **Whom to trust.** Whoever reaches a Dask scheduler can run any code on all workers, and on the
  machine that asks. Bind it to a network of your own, or use certificates: `tls://HOST:PORT`, with
  `distributed.comm.tls` in Dask's configuration.
"""


def page(report: dict[str, Any]) -> str:
    """In Markdown."""
    parts = [HEAD, task_part(report), worker_part(report), scaling_part(report), plan(report)]
    return "\n".join([*parts, f"## Conditions\n\n{conditions(report)}.\n"])


def task_part(report: dict[str, Any]) -> str:
    """What a task costs."""
    rows = [
        [
            row["executor"],
            f"{row['rows']:,}",
            spread(row["wall"], 1e3),
            spread(row["client_cpu"], 1e3),
            spread(row["scheduler_cpu"], 1e3) if row["executor"] == DASK else "-",
        ]
        for row in report["tasks"]
    ]
    head = ["shared by", "rows of a task", "wall", "CPU of the command", "CPU of the scheduler"]
    return f"""## What a task costs

A task is a chunk of runs. Here workers run nothing, and only hand back rows, two at a time.
Milliseconds a task, median (quartiles):

{table(head, rows)}

A chunk of a sweep takes a second and a half: what sharing costs is little beside it.
"""


def worker_part(report: dict[str, Any]) -> str:
    """What a worker costs before its first row."""
    new = {name: value["median"] for name, value in report["new_worker"].items()}
    kernels = f"{new['first_chunk'] - new['second_chunk']:.2f}"
    scene, ready, code = report["scene"], f"{new['ready']:.1f}", f"{new['machine_code']:.2f}"
    first, second = f"{new['first_chunk']:.2f}", f"{new['second_chunk']:.2f}"
    whole = f"{new['ready'] + new['first_chunk'] - new['second_chunk']:.1f}"
    return f"""## What a new worker costs

CPU seconds of a process, scene `{scene}`, medians: {ready} until it has imported what runs need,
{first} for its first chunk of eight runs, {second} for the second one. So kernels cost {kernels} s
a worker, {code} of it in LLVM, once for each kind of scene (which effects, how many balls), not
for each run. Each process makes its own: nothing is kept on disk. A cache of object code shared by
a host's workers could save LLVM's part at most, {code} s of {whole} s that a worker takes to be
ready, while a worker lives for hours; formulas would still be traced. It would have to be named by
all that code is made of, the processor among it, and locked. It is not worth that, and so not
there.
"""


def scaling_part(report: dict[str, Any]) -> str:
    """Over workers."""
    waits = [
        [
            row["executor"],
            str(row["workers"]),
            spread({k: 100 * v for k, v in row["share"].items()}),
        ]
        for row in report["waiting"]
    ]
    runs = [
        [
            row["executor"],
            str(row["workers"]),
            spread(row["runs_per_second"]),
            spread(row["of_one_worker"]),
        ]
        for row in report["throughput"]
    ]
    machine = report["machine"]
    early, late = (
        f"{machine[which][0]:.1f}" for which in ("load_average", "load_average_at_the_end")
    )
    scene, chunk, cores = report["scene"], report["chunk"], machine["cores"]
    apart = next(
        row["of_one_worker"]["median"]
        for row in report["throughput"]
        if row["executor"] == APART and row["workers"] == 2
    )
    wait_table = table(["shared by", "workers", "at work [%]"], waits)
    run_table = table(["shared by", "workers", "runs/s", "to one worker of the same kind"], runs)
    return f"""## More workers

Where work is waiting, for a quarter of a second at a time, so that no processor is wanting: share
of their time that all workers are at it, in percent.

{wait_table}

Runs, `{scene}`, chunks of {chunk}, on {cores} cores that other work shared (load {early} at
the beginning, {late} at the end): what these cores had left shows here more than anything else.

{run_table}

All of these rows were compared: they are the same to the bit. *Nothing shared*: processes that
had their runs from the beginning, and hand nothing back; two of them show what a second processor
gives here, {apart:.2f} times one.
"""


def plan(report: dict[str, Any]) -> str:
    """For a hundred hosts."""
    one, most = (
        next(row for row in report["tasks"] if row["executor"] == DASK and right(row["rows"]))
        for right in (lambda rows: rows == 1, lambda rows: rows > 1)
    )
    threads = HOSTS * CORES
    scheduler = one["scheduler_cpu"]["median"]
    task = one["client_cpu"]["median"]
    run = (most["client_cpu"]["median"] - task) / (most["rows"] - 1)
    run += report["client"]["cpu_per_run"]["median"]
    rate = max(
        row["runs_per_second"]["median"]
        for row in report["throughput"]
        if row["workers"] == 1 and row["executor"] == DASK
    )
    chunk = threads * max(scheduler, task) / SHARE
    wanted, least = threads * rate, 1.0 / run
    limits = wanted > SHARE * least
    verdict = (
        "So the command would be the limit:"
        if limits
        else "So the command is not the limit with this scene, but with one whose runs are shorter:"
    )
    each, most_tasks = f"{1e3 * scheduler:.2g}", f"{1 / scheduler:,.0f}"
    asked, seconds = f"{threads / CHUNK_SECONDS:,.0f}", math.ceil(chunk / 10) * 10
    load, own = f"{100 * SHARE:.0f}", f"{1e3 * task:.2g}"
    cost, most_runs, given = f"{1e6 * run:.2g}", f"{least:,.0f}", f"{wanted:,.0f}"
    count, one_rate = f"{threads:,}", f"{rate:.0f}"
    return f"""## A plan for a hundred hosts

Computed from the figures above for {HOSTS} hosts of {CORES} cores, {count} workers; none of it was
tried.

- **The scheduler** is one process, {each} ms of CPU a task here: at most {most_tasks} tasks a
  second. With chunks of {CHUNK_SECONDS} s, {count} workers would ask for {asked}.
- **Chunks** of {seconds} s would load scheduler and command to {load} % (the command takes {own}
  ms a task). A sweep has to be long for that: some ten chunks a worker, or the last ones are
  waited for. `CHUNK_SECONDS` in `design/work.py` sets them; it would follow from the number of
  workers.
- **The command** takes {cost} us a run, to make its point, unpickle its row and keep it: at most
  {most_runs} runs a second. {count} workers at {one_rate} runs/s each would give {given}.
  {verdict} workers would then write each chunk's rows as a Parquet part into a folder that all
  hosts share, and hand back its name only. Parts are named by a hash of their content already,
  written whole or not at all, and checked when they are read; what is left for the command is to
  send numbers of runs in place of their values, and to read parts when all are there.
- **Begin**: {count} workers that import from one shared disk at once are slow; install ab_sim on
  each host's own.
"""
