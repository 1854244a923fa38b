"""`ab-sim sweep`."""

from collections.abc import Iterator

import numpy as np
from rich.table import Table

from ab_sim.analysis.metrics.metric import Better, metrics_named
from ab_sim.base.files import CSV, PARQUET
from ab_sim.base.presentation import Progress, number
from ab_sim.base.workers import KEPT
from ab_sim.cli.checks import executor_of, outcome_notes, wanted_metrics
from ab_sim.cli.design_commands import SweepOptions
from ab_sim.cli.runner import Command, Outcome, new_table, plotted
from ab_sim.design.judged import OUTCOME, has_settled
from ab_sim.design.points import points_of
from ab_sim.design.sweep import Sweep, run_sweep
from ab_sim.design.variables import variable_of
from ab_sim.scene import load_scene
from ab_sim.scene.units import shown_units


def sweep_command(options: SweepOptions) -> Command:
    """Return the command that runs a scene over values of keys."""
    shown_units(options.units)
    executor = executor_of(options.workers, options.scheduler)
    scene = load_scene(options.scene, options.change)
    points = points_of([variable_of(text) for text in options.over], options.design, options.seed)
    metrics = wanted_metrics(options.metrics)

    def work(tell: Progress) -> Outcome:
        sweep = run_sweep(scene, points, metrics, executor, tell)
        table = sweep.in_units(options.units)
        writes = {"--parquet": sweep.write, "--csv": sweep.write}
        return Outcome(_shown(table), sweep.report, plotted(table), writes)

    outputs = ((options.parquet, PARQUET, "--parquet"), (options.csv, CSV, "--csv"))
    return Command(work, scene.name, KEPT, outputs)


def _shown(sweep: Sweep) -> Iterator[Table | str]:
    title = f"{sweep.scene.name}: {len(sweep.table)} runs; metrics of those that settled"
    table = new_table("metric", "smallest | median | largest", title=title)
    for metric in sweep.metrics:
        values = sweep.shown(metric)[has_settled(sweep[OUTCOME])].astype(float)
        values = values[np.isfinite(values)]
        numbers = [float(f(values)) for f in (np.min, np.median, np.max)] if len(values) else []
        table.add_row(sweep.titled(metric), *([number(value) for value in numbers] or ["-"] * 3))
    yield table
    for judged in metrics_named(sweep.metrics):
        best = None if judged.better is Better.NEITHER else sweep.best(judged.key)
        if best is not None:
            value = number(float(sweep.shown(judged.key)[best]))
            line = f"best {sweep.titled(judged.key)}: {value} in run {best}"
            yield f"{line}, {sweep[OUTCOME][best]}: {_where(sweep, best)}"
    yield ", ".join(f"{name}: {count}" for name, count in sweep.outcomes.items())
    for outcome, reason in sweep.reasons.items():
        yield f"{outcome}, the first one: {reason}"
    yield from outcome_notes(sweep)


def _where(sweep: Sweep, run: int) -> str:
    values = {key: sweep[key][run] for key in sweep.keys}
    return ", ".join(
        sweep.setting(key, value if isinstance(value, str) else float(value))
        for key, value in values.items()
    )
