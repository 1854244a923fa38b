"""`ab-sim robust`."""

import functools
from collections.abc import Iterator, Sequence

from rich.table import Table

from ab_sim.base.output_file import CSV, PARQUET
from ab_sim.base.presentation import number
from ab_sim.base.progress import Progress
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
from ab_sim.scene.shown_units import shown_units

FINER = (0.01, 0.001)
"""Half-widths for which the necessary number of runs is printed."""
HALF_WIDTH = "must be the half width of the interval, e.g. 0.1%"


def robust_command(given: RobustOptions) -> Command:
    """Return the command that runs drives with manufacturing tolerances."""
    shown_units(given.units)
    executors = functools.partial(executor_of, given.workers, given.scheduler)
    executors()
    scene = load_scene(given.scene, given.change)
    other = None if given.against is None else load_scene(given.against)
    if other is not None and other.name == scene.name:
        scene = _named_by_file(scene, given.scene, *(f"--set {each}" for each in given.change))
        other = _named_by_file(other, str(given.against))
    tolerances = [] if given.spread_from is None else fitted_tolerances(given.spread_from)
    tolerances += [tolerance_of(each) for each in given.spread]
    question = SpreadQuestion(
        runs=given.runs,
        metrics=wanted_metrics(given.metrics),
        criterion=tuple(map(bound_of, given.balanced)) or DEFAULT_CRITERION,
        seed=given.seed,
        pairs=given.sobol,
        until=None if given.until is None else share_of("until", given.until, HALF_WIDTH),
        against=other,
    )
    if given.worst is not None:
        check_worst_folder(given.worst)

    def work(tell: Progress) -> Outcome:
        result = run_spread(scene, tolerances, question, executors, tell)
        spread = result.in_units(given.units)
        writes: dict[str, Write | None] = {
            "--parquet": result.write, "--csv": result.write, "--worst": result.write_worst
        }  # fmt: skip
        lines = _shown(spread, given.scene, given.change)
        return Outcome(lines, result.report, plotted(spread), writes)

    outputs: list[Output] = [
        (given.parquet, PARQUET, "--parquet"), (given.csv, CSV, "--csv"),
        (given.worst, (), "--worst"),
    ]  # fmt: skip
    return Command(work, scene.name, KEPT, outputs)


def _named_by_file(scene: Scene, *words: str) -> Scene:
    """Return the scene with a name that distinguishes it from another one of the same name."""
    return changed_scene(scene, {"name": f"{scene.name} ({' '.join(words)})"}, "against")


def _shown(found: Spread, scene_name: str, changes: Sequence[str]) -> Iterator[Table | str]:
    share = found.share
    criterion = " and ".join(each.text for each in found.criterion)
    yield (
        f"{found.scene.name}: {share.balanced} of {share.runs} drives balance, "
        f"{share_text(share)}; settled or ringing down, and {criterion}"
    )
    yield ", ".join(f"{name}: {count}" for name, count in found.runs.outcomes.items())
    for outcome, reason in found.runs.reasons.items():
        yield f"{outcome} count as not balanced, the first one: {reason}"
    yield from outcome_notes(found.runs)
    yield _more_runs(found)
    yield _quantile_table(found)
    yield from _sobol(found)
    if found.against is not None:
        yield from _against(found, found.against)
    yield f"the worst by {found.ranked_by}, to be run again:"
    options = "".join(f"--set {each!r} " for each in changes)
    for each in found.worst:
        value = None if each.value is None else each.value * found.runs.factor(found.ranked_by)
        yield WholeLine(
            f"run {each.run}, {each.outcome}, {number(value)}: "
            f"{own_command()} run {scene_name} {options}{each.changes}"
        )


def _more_runs(found: Spread) -> str:
    share = found.share
    finer = [share.half_width / 2.0, *(h for h in FINER if h < share.half_width / 2.0)]
    said = [
        f"+-{100.0 * half:.2g} % takes about {share.runs_for(half) - share.runs:,} more runs"
        for half in finer
    ]
    return f"now +-{100.0 * share.half_width:.2g} %; " + ", ".join(said)


def _quantile_table(found: Spread) -> Table:
    title = "quantiles of the runs that have a metric, and their intervals of 95 %"
    table = new_table("metric", "runs | 5 % | median | 95 %", no_wrap=True, title=title)
    for metric, quantiles in found.quantiles.items():
        count = int((found[metric] == found[metric]).sum())
        cells = [_interval(each, found.runs.factor(metric)) for each in quantiles] or ["-"] * 3
        table.add_row(found.runs.titled(metric), str(count), *cells)
    return table


def _interval(found: QuantileOfMetric, factor: float) -> str:
    low, high = (_end(end, factor) for end in (found.low, found.high))
    return f"{number(found.value * factor)} ({low} to {high})"


def _end(value: float | None, factor: float) -> str:
    return "?" if value is None else number(value * factor)


def _sobol(found: Spread) -> Iterator[Table | str]:
    sobol = found.sobol
    if not sobol.pairs:
        yield f"no Sobol indices: {sobol.none}"
        return
    title = "Sobol indices, and their intervals of 95 %"
    table = new_table("of | spread", "alone | with others", no_wrap=True, title=title)
    for what, indices in sobol.indices.items():
        for place, each in enumerate(indices):
            table.add_row(
                what if place == 0 else "",
                each.factor,
                f"{each.first:.2f} ({each.first_interval[0]:.2f} to {each.first_interval[1]:.2f})",
                f"{each.total:.2f} ({each.total_interval[0]:.2f} to {each.total_interval[1]:.2f})",
                end_section=place == len(indices) - 1,
            )
    if sobol.indices:
        yield table
    yield f"Sobol indices are of {sobol.pairs} pairs of drives, and took {sobol.runs} runs more"
    if sobol.pairs < FEW_PAIRS:
        yield (
            f"these are few: below {FEW_PAIRS} pairs neither indices nor intervals are reliable; "
            f"use --sobol {FEW_PAIRS} or more, and --runs of at least twice that"
        )
    for name, reason in sobol.missing.items():
        yield f"no Sobol indices of {name}: {reason}"


def _against(found: Spread, other: DesignDifference) -> Iterator[Table | str]:
    paired = other.paired
    yield (
        f"against {other.runs.scene.name} in the same draws: it balances {share_text(other.share)}"
    )
    yield (
        f"{found.scene.name} balances {100.0 * paired.difference:+.2f} % more "
        f"({100.0 * paired.low:+.2f} to {100.0 * paired.high:+.2f} %); only it: "
        f"{paired.only_first}, only the other: {paired.only_second}, both: {paired.both}, "
        f"neither: {paired.neither}; McNemar's p = {paired.p_value:.2g}"
    )
    title = f"{found.scene.name} less {other.runs.scene.name}, draw by draw"
    table = new_table("metric", "draws | mean | median", no_wrap=True, title=title)
    for metric, each in other.metrics.items():
        factor = found.runs.factor(metric)
        mean, low, high = (number(x * factor) for x in (each.mean, each.low, each.high))
        cells = f"{mean} ({low} to {high})", _interval(each.median, factor)
        table.add_row(found.runs.titled(metric), str(each.pairs), *cells)
    yield table
