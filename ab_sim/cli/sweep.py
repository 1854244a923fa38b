"""`ab-sim sweep`."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.table import Table

from ab_sim.analysis.merits.merit import Better, merits_named
from ab_sim.cli.progress import Tell
from ab_sim.cli.runner import Command, Outcome, plotted
from ab_sim.cli.sharing import executor_of
from ab_sim.cli.words import outcome_notes, wanted_merits
from ab_sim.design.judged import OUTCOME, has_settled
from ab_sim.design.points import points_of
from ab_sim.design.sweep import Sweep, run_sweep
from ab_sim.design.variables import variable_of
from ab_sim.output_file import CSV, PARQUET
from ab_sim.presentation import number
from ab_sim.scene import load_scene
from ab_sim.scene.shown_units import shown_units
from ab_sim.workers import KEPT


class SweepOptions(NamedTuple):
    """Options of `ab-sim sweep`, as texts."""

    over: list[str]
    """Variables, see ``variable_of``."""
    design: str | None
    """Design, see ``points_of``."""
    seed: int
    merits: str | None
    """Names of metrics, separated by commas; None: the default ones."""
    units: str
    """Units for display, see ``shown_units``."""


def sweep_command(
    scene_name: str,
    changes: list[str],
    given: SweepOptions,
    shared: tuple[int | None, str | None],
    files: tuple[Path | None, Path | None],
) -> Command:
    """Return the command that runs a scene over values of keys.

    Args:
        scene_name, changes: see ``load_scene``.
        given: variables, design and metrics.
        shared: workers and scheduler, see ``executor_of``.
        files: files for Parquet and CSV.
    """
    shown_units(given.units)
    executor = executor_of(*shared)
    scene = load_scene(scene_name, changes)
    points = points_of([variable_of(each) for each in given.over], given.design, given.seed)
    wanted = wanted_merits(given.merits)
    table, comma = files

    def work(tell: Tell) -> Outcome:
        found = run_sweep(scene, points, wanted, executor, tell)

        writes = [partial(found.write, file) for file in (table, comma) if file is not None]
        shown = found.in_units(given.units)
        return Outcome(_shown(shown), found.report, plotted(shown), writes)

    outputs = ((table, PARQUET, "--parquet"), (comma, CSV, "--csv"))
    return Command(work, scene.name, KEPT, outputs)


def _shown(found: Sweep) -> Iterator[Table | str]:
    table = Table(title=f"{found.scene.name}: {len(found.table)} runs, of which those that settled")
    for name in ("merit", "least", "median", "largest"):
        table.add_column(name, justify="left" if name == "merit" else "right")
    for merit in found.merits:
        values = found.shown(merit)[has_settled(found[OUTCOME])].astype(float)
        values = values[np.isfinite(values)]
        numbers = [float(f(values)) for f in (np.min, np.median, np.max)] if len(values) else []
        table.add_row(found.titled(merit), *([number(each) for each in numbers] or ["-"] * 3))
    yield table
    for judged in merits_named(found.merits):
        best = None if judged.better is Better.NEITHER else found.best(judged.key)
        if best is not None:
            value = number(float(found.shown(judged.key)[best]))
            said = f"best {found.titled(judged.key)}: {value} in run {best}"
            yield f"{said}, {found[OUTCOME][best]}: {_where(found, best)}"
    yield ", ".join(f"{name}: {count}" for name, count in found.outcomes.items())
    for outcome, reason in found.reasons.items():
        yield f"{outcome}, the first one: {reason}"
    yield from outcome_notes(found)


def _where(found: Sweep, run: int) -> str:
    values = {key: found[key][run] for key in found.keys}
    return ", ".join(
        found.setting(key, value if isinstance(value, str) else float(value))
        for key, value in values.items()
    )
