"""`ab-sim recovery`."""

import math
from collections.abc import Iterator

import numpy as np
from rich.table import Table

from ab_sim.analysis.recovery import (
    LONGEST,
    Recovery,
    RecoveryOverDrag,
    composite_of,
    recovery_over_drag,
)
from ab_sim.base.errors import InputError
from ab_sim.base.numbers import number_in, whole_number_in
from ab_sim.base.presentation import Progress
from ab_sim.cli.analysis_commands import RecoveryOptions
from ab_sim.cli.runner import Command, Outcome, picture
from ab_sim.scene import load_scene

MOST = 1000
"""Largest number of drags."""


def recovery_command(options: RecoveryOptions) -> Command:
    """Return the command that computes the recovery from a scene's change of speed, over drags."""
    values = drags_of(options.drags)
    scene = load_scene(options.scene, options.change)

    def work(tell: Progress) -> Outcome:
        recovery = recovery_over_drag(scene, values, tell)
        draw = picture("ab_sim.show.figures.recovery:recovery_figure", recovery)
        return Outcome(_shown(recovery), recovery.report, draw)

    return Command(work, scene.name)


def drags_of(text: str) -> tuple[float, ...]:
    """Parse ``first:last:count`` to evenly spaced drags [N s/m].

    Raises:
        InputError: the text has another form.
    """
    try:
        first, last, count = text.split(":")
        low, high, n = number_in(first), number_in(last), whole_number_in(count)
    except ValueError:
        low, high, n = math.nan, math.nan, 0
    if not (0.0 < low < high < math.inf and 2 <= n <= MOST):
        raise InputError(
            f"--drags {text}: must be first:last:count, two rising numbers above 0 [N s/m] and a "
            f"whole number from 2 to {MOST}, e.g. 0.1:0.5:5"
        )
    return tuple(float(f"{drag:.12g}") for drag in np.linspace(low, high, n))


def recovery_table(results: RecoveryOverDrag, balls: int, runs: tuple[Recovery, ...]) -> Table:
    """Return the table of recoveries, with all balls or with one.

    Args:
        results: results over the drags.
        balls: number of balls in the runs.
        runs: recovery at the scene's drag, then at each of the drags over which they were computed.
    """
    several = "1 ball" if balls == 1 else f"{balls} balls"
    title = (
        f"{results.scene}, {several}: from {results.from_speed:g} to {results.to_speed:g} rad/s, "
        f"settled within {1e3 * results.band:g} mm"
    )
    table = Table(title=title)
    for name in ("drag [N s/m]", "settling [s]", "amplitude [mm]", "lambda_Rmax [1/s]"):
        table.add_column(name, justify="right")
    table.add_column("at rest")
    table.add_column("composite [s]", justify="right")
    composite = composite_of(runs[1:])
    index = (None, *(composite.index if composite else [None] * len(results.drags)))
    for k, (drag, run) in enumerate(zip((results.drag, *results.drags), runs, strict=True)):
        rest = "nowhere" if run.label is None else f"{run.label}, {run.verdict}"
        prefix = "scene: " if k == 0 else ""
        cells = (f"{prefix}{drag:g}", *_cells(run), rest, _text(index[k]))
        table.add_row(*cells, end_section=k == 0)
    return table


def _cells(run: Recovery) -> list[str]:
    return [_text(run.settling_time), f"{1e3 * run.maximum_amplitude:.5g}", _text(run.lambda_max)]


def _text(value: float | None) -> str:
    return "-" if value is None else f"{value:.5f}"


def _shown(results: RecoveryOverDrag) -> Iterator[Table | str]:
    yield recovery_table(results, results.balls, (results.own, *results.over))
    if results.one_ball is not None:
        yield recovery_table(results, 1, results.one_ball)
    runs = (results.own, *results.over, *(results.one_ball or ()))
    if results.best_drag is not None and results.composite is not None:
        yield (
            f"best of these drags: {results.best_drag:g} N s/m, where the composite index is "
            f"smallest: settling time + {results.composite.factor:.5g} s/m x amplitude; the factor "
            "is the mean settling time over the mean amplitude of the drags in the table"
        )
    if any(run.settling_time is None for run in runs):
        longest = max(run.duration for run in runs)
        yield (
            f"-: not settled after {longest:g} s, {LONGEST:g} times the scene's duration; there "
            "may be no stable state (ab-sim equilibria), or it takes longer (--set duration=...)"
        )
    if not all(run.rested_before for run in runs):
        yield "some drives did not rest before the change began: set profile.start_time later"
    if any(run.verdict == "undecided" for run in runs):
        yield "undecided: lambda_Rmax is 0; only the run shows whether this start settles"
    if results.together:
        yield (
            "balls that start at one angle stay together, and settle like one ball with their "
            "total mass and drag; lambda_Rmax may belong to a motion that separates them, which "
            "this run does not excite: change start.ball_angles"
        )
