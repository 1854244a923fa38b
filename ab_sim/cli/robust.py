"""`ab-sim robust`."""

import functools
from collections.abc import Iterator, Sequence

from rich.table import Table

from ab_sim.base.files import CSV, PARQUET
from ab_sim.base.presentation import Progress, number
from ab_sim.base.workers import KEPT
from ab_sim.cli.checks import executor_of, outcome_notes, share_of, wanted_metrics
from ab_sim.cli.design_commands import RobustOptions
from ab_sim.cli.outputs import Output, own_command
from ab_sim.cli.runner import Command, Outcome, WholeLine, Write, new_table, plotted
from ab_sim.design.bounds import bound_of
from ab_sim.design.fitted_spread import fitted_tolerances
from ab_sim.design.intervals import QuantileOfMetric
from ab_sim.design.spread import DesignDifference, Spread, check_worst_folder, share_text
from ab_sim.design.spread_runs import DEFAULT_CRITERION, FEW_PAIRS, SpreadQuestion, run_spread
from ab_sim.design.tolerances import tolerance_of
from ab_sim.scene import Scene, load_scene
from ab_sim.scene.load import changed_scene
from ab_sim.scene.units import shown_units

FINER = (0.01, 0.001)
"""Half-widths for which the necessary number of runs is printed."""
HALF_WIDTH = "must be the half-width of the interval, e.g. 0.1%"


def robust_command(options: RobustOptions) -> Command:
    """Return the command that runs drives with manufacturing tolerances."""
    shown_units(options.units)
    executors = functools.partial(executor_of, options.workers, options.scheduler)
    executors()
    scene = load_scene(options.scene, options.change)
    other = None if options.against is None else load_scene(options.against)
    if other is not None and other.name == scene.name:
        scene = _named_by_file(
            scene, options.scene, *(f"--set {change}" for change in options.change)
        )
        other = _named_by_file(other, str(options.against))
    tolerances = [] if options.spread_from is None else fitted_tolerances(options.spread_from)
    tolerances += [tolerance_of(tolerance) for tolerance in options.spread]
    question = SpreadQuestion(
        runs=options.runs,
        metrics=wanted_metrics(options.metrics),
        criterion=tuple(map(bound_of, options.balanced)) or DEFAULT_CRITERION,
        seed=options.seed,
        pairs=options.sobol,
        until=None if options.until is None else share_of("until", options.until, HALF_WIDTH),
        against=other,
    )
    if options.worst is not None:
        check_worst_folder(options.worst)

    def work(tell: Progress) -> Outcome:
        result = run_spread(scene, tolerances, question, executors, tell)
        spread = result.in_units(options.units)
        writes: dict[str, Write | None] = {
            "--parquet": result.write, "--csv": result.write, "--worst": result.write_worst
        }  # fmt: skip
        lines = _shown(spread, options.scene, options.change)
        return Outcome(lines, result.report, plotted(spread), writes)

    outputs: list[Output] = [
        (options.parquet, PARQUET, "--parquet"), (options.csv, CSV, "--csv"),
        (options.worst, (), "--worst"),
    ]  # fmt: skip
    return Command(work, scene.name, KEPT, outputs)


def _named_by_file(scene: Scene, *words: str) -> Scene:
    """Return the scene with its file and changes in the name, to distinguish two designs."""
    return changed_scene(scene, {"name": f"{scene.name} ({' '.join(words)})"}, "against")


def _shown(spread: Spread, scene_name: str, changes: Sequence[str]) -> Iterator[Table | str]:
    share = spread.share
    criterion = " and ".join(bound.text for bound in spread.criterion)
    yield (
        f"{spread.scene.name}: {share.balanced} of {share.runs} drives balance, "
        f"{share_text(share)}; settled or ringing down, and {criterion}"
    )
    yield ", ".join(f"{name}: {count}" for name, count in spread.runs.outcomes.items())
    for outcome, reason in spread.runs.reasons.items():
        yield f"{outcome} runs count as not balanced; the first one: {reason}"
    yield from outcome_notes(spread.runs)
    yield _more_runs(spread)
    yield _quantile_table(spread)
    yield from _sobol(spread)
    if spread.against is not None:
        yield from _against(spread, spread.against)
    yield f"worst runs by {spread.ranked_by}, with the commands that repeat them:"
    options = "".join(f"--set {change!r} " for change in changes)
    for worst_run in spread.worst:
        value = (
            None
            if worst_run.value is None
            else worst_run.value * spread.runs.factor(spread.ranked_by)
        )
        yield WholeLine(
            f"run {worst_run.run}, {worst_run.outcome}, {number(value)}: "
            f"{own_command()} run {scene_name} {options}{worst_run.changes}"
        )


def _more_runs(spread: Spread) -> str:
    share = spread.share
    finer = [share.half_width / 2.0, *(h for h in FINER if h < share.half_width / 2.0)]
    reports = [
        f"+-{100.0 * half:.2g} % takes about {share.runs_for(half) - share.runs:,} more runs"
        for half in finer
    ]
    return f"now +-{100.0 * share.half_width:.2g} %; " + ", ".join(reports)


def _quantile_table(spread: Spread) -> Table:
    title = "quantiles over the runs that have a metric, with 95 % intervals"
    table = new_table("metric", "runs | 5 % | median | 95 %", no_wrap=True, title=title)
    for metric, quantiles in spread.quantiles.items():
        count = int((spread[metric] == spread[metric]).sum())
        cells = [_interval(quantile, spread.runs.factor(metric)) for quantile in quantiles] or [
            "-"
        ] * 3
        table.add_row(spread.runs.titled(metric), str(count), *cells)
    return table


def _interval(quantile_of_metric: QuantileOfMetric, factor: float) -> str:
    low, high = (_end(end, factor) for end in (quantile_of_metric.low, quantile_of_metric.high))
    return f"{number(quantile_of_metric.value * factor)} ({low} to {high})"


def _end(value: float | None, factor: float) -> str:
    return "?" if value is None else number(value * factor)


def _sobol(spread: Spread) -> Iterator[Table | str]:
    sobol = spread.sobol
    if not sobol.pairs:
        yield f"no Sobol indices: {sobol.none}"
        return
    title = "Sobol indices, with 95 % intervals"
    table = new_table("of | spread", "alone | with others", no_wrap=True, title=title)
    for what, indices in sobol.indices.items():
        for place, effect in enumerate(indices):
            intervals = effect.first_interval, effect.total_interval
            first, total = (f"({low:.2f} to {high:.2f})" for low, high in intervals)
            table.add_row(
                what if place == 0 else "",
                effect.factor,
                f"{effect.first:.2f} {first}",
                f"{effect.total:.2f} {total}",
                end_section=place == len(indices) - 1,
            )
    if sobol.indices:
        yield table
    yield f"Sobol indices: from {sobol.pairs} pairs of drives, with {sobol.runs} further runs"
    if sobol.pairs < FEW_PAIRS:
        yield (
            f"these are few: below {FEW_PAIRS} pairs, neither indices nor intervals are reliable; "
            f"use --sobol {FEW_PAIRS} or more, and at least twice as many --runs"
        )
    for name, reason in sobol.missing.items():
        yield f"no Sobol indices of {name}: {reason}"


def _against(spread: Spread, other: DesignDifference) -> Iterator[Table | str]:
    paired = other.paired
    yield (f"{other.runs.scene.name}, with the same draws, balances {share_text(other.share)}")
    yield (
        f"{spread.scene.name} balances {100.0 * paired.difference:+.2f} % more "
        f"({100.0 * paired.low:+.2f} to {100.0 * paired.high:+.2f} %); draws in which only it "
        f"balances: {paired.only_first}, only the other: {paired.only_second}, both: "
        f"{paired.both}, neither: {paired.neither}; McNemar's p = {paired.p_value:.2g}"
    )
    title = f"{spread.scene.name} minus {other.runs.scene.name}, draw by draw"
    table = new_table("metric", "draws | mean | median", no_wrap=True, title=title)
    for metric, difference in other.metrics.items():
        factor = spread.runs.factor(metric)
        mean, low, high = (
            number(x * factor) for x in (difference.mean, difference.low, difference.high)
        )
        cells = f"{mean} ({low} to {high})", _interval(difference.median, factor)
        table.add_row(spread.runs.titled(metric), str(difference.pairs), *cells)
    yield table
