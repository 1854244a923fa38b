"""`ab-sim sweep`, `ab-sim tune`, `ab-sim robust` and `ab-sim size`."""

import functools
import shlex
from collections.abc import Iterator, Sequence

import numpy as np
from rich.table import Table

from ab_sim.analysis.metrics.metric import Better, metrics_named
from ab_sim.base.errors import InputError
from ab_sim.base.files import CSV, PARQUET, SCENE
from ab_sim.base.presentation import Progress, number
from ab_sim.base.workers import KEPT
from ab_sim.cli.checks import executor_of, outcome_notes, share_of, wanted_metrics
from ab_sim.cli.design_commands import RobustOptions, SizeOptions, SweepOptions, TuneOptions
from ab_sim.cli.outputs import Output, own_command
from ab_sim.cli.runner import Command, Outcome, WholeLine, Write, new_table, picture, scene_writer
from ab_sim.design.bounds import bound_of
from ab_sim.design.judged import OUTCOME, has_settled
from ab_sim.design.points import Range, points_of, variable_of
from ab_sim.design.search import Task
from ab_sim.design.sizing.claims import Running
from ab_sim.design.sizing.drag_window import SizedBalls
from ab_sim.design.sizing.size import Sizing, run_sizing, sizing_failure
from ab_sim.design.sizing.specification import SpecificationTexts, specification_of
from ab_sim.design.spread import DesignDifference, Spread, check_worst_folder, share_text
from ab_sim.design.spread_runs import DEFAULT_CRITERION, FEW_PAIRS, SpreadQuestion, run_spread
from ab_sim.design.statistics import QuantileOfMetric
from ab_sim.design.sweep import Sweep, run_sweep
from ab_sim.design.tolerances import fitted_tolerances, tolerance_of
from ab_sim.design.tune import (
    AS_IT_IS,
    NO_PERIOD,
    NearMiss,
    Tuning,
    aim_of,
    near_misses,
    run_tuning,
)
from ab_sim.scene import Scene, load_scene
from ab_sim.scene.load import changed_scene
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
        return Outcome(_sweep_shown(table), sweep.report, picture("sweep", table), writes)

    outputs = ((options.parquet, PARQUET, "--parquet"), (options.csv, CSV, "--csv"))
    return Command(work, scene.name, KEPT, outputs)


def _sweep_shown(sweep: Sweep) -> Iterator[Table | str]:
    """Yield the table of metrics, the best runs, and notes on outcomes."""
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
    """Return the values of the keys in a run as text."""
    values = {key: sweep[key][run] for key in sweep.keys}
    return ", ".join(
        sweep.setting(key, value if isinstance(value, str) else float(value))
        for key, value in values.items()
    )


def tune_command(options: TuneOptions) -> Command:
    """Return the command that optimises values of a scene within limits."""
    shown_units(options.units)
    executor = executor_of(options.workers, options.scheduler)
    scene = load_scene(options.scene, options.change)
    tolerances = tuple(map(tolerance_of, options.spread))
    draws = options.draws if tolerances else 1
    task = Task(
        scene,
        tuple(map(_range, options.vary)),
        aim_of(options.minimise, options.maximise),
        tuple(map(bound_of, options.subject_to)),
        options.runs // draws,
        options.seed,
        tolerances,
        draws,
        _share(options.share) if tolerances else 1.0,
    )

    def work(tell: Progress) -> Outcome:
        result = run_tuning(task, executor, tell)
        tuning = result.in_units(options.units)
        return Outcome(
            _tuning_shown(tuning),
            result.report,
            picture("tuning", tuning),
            {
                "--scene": None if result.scene is None else scene_writer(result.scene_text),
                "--parquet": result.runs.write,
            },
            failure=_nothing_found(tuning, options.scene) if tuning.candidate is None else None,
        )

    outputs = ((options.best_scene, SCENE, "--scene"), (options.parquet, PARQUET, "--parquet"))
    return Command(work, scene.name, KEPT, outputs)


def _range(text: str) -> Range:
    """Parse the range of ``--vary``."""
    variable = variable_of(text)
    if not isinstance(variable, Range):
        raise InputError(f"--vary {text}: must be a range, {variable.key}=FROM..TO")
    return variable


def _share(text: str) -> float:
    """Parse the share of ``--share``, in percent; return it as a fraction."""
    number_, percent, rest = text.strip().partition("%")
    try:
        share = float(number_) / 100.0
    except ValueError:
        share = -1.0
    if not percent or rest or not 0.0 < share <= 1.0:
        raise InputError(f"--share {text}: must be above 0 %, at most 100 %, e.g. 90%")
    return share


def _tuning_shown(tuning: Tuning) -> Iterator[Table | str]:
    counts = ", ".join(f"{name}: {count}" for name, count in tuning.runs.outcomes.items())
    inside, looked_at = int(tuning.scores.within.sum()), len(tuning.candidates)
    line = f"{looked_at} candidates, {inside} of them within all bounds; runs: {counts}"
    task = tuning.task
    if tuning.candidate is None:
        yield line
        yield from _left_out(tuning)
        yield from map(functools.partial(_missed, tuning), near_misses(tuning))
        return
    title = f"{tuning.runs.scene.name}: {task.aim}"
    table = new_table("key", "best | from | to", title=title)
    for range_ in task.ranges:
        factor = tuning.runs.factor(range_.key)
        cells = [number(x * factor) for x in (tuning.values[range_.key], range_.low, range_.high)]
        table.add_row(tuning.runs.titled(range_.key), *cells)
    yield table
    if task.draws > 1:
        yield f"value that {100 * task.share:g} % of a candidate's {task.draws} drives reach:"
    factor = tuning.runs.factor(task.aim.metric)
    verdict = "" if task.draws > 1 else f", {tuning.runs[OUTCOME][tuning.candidate]}"
    yield f"{tuning.runs.titled(task.aim.metric)}: {_aim_text(tuning.best, factor)}{verdict}"
    if AS_IT_IS in tuning.as_good:
        yield "this is no better than the scene as it is"
    if NO_PERIOD in tuning.as_good:
        none = _aim_text(tuning.as_good[NO_PERIOD], factor)
        yield f"without a variable-speed period, the scene is as good or better: {none}"
    for name, metric, inside_ in tuning.before:
        yield f"  the scene {name}: {_aim_text(metric, factor, inside_)}"
    for key, value, metric, inside_ in tuning.nearby:
        yield f"  at {tuning.runs.setting(key, value)}: {_aim_text(metric, factor, inside_)}"
    if tuning.active:
        yield f"at an end of its range or a bound that limits it: {', '.join(tuning.active)}"
    yield line
    yield from _left_out(tuning)


def _left_out(tuning: Tuning) -> Iterator[str]:
    """Yield lines on candidates that do not count, and notes on outcomes."""
    for name, (count, better) in tuning.left_out.items():
        ahead = f", {better} of them better at their end than the best" if better else ""
        yield f"not counted: {count} candidates, {name}{ahead}"
    yield from outcome_notes(tuning.runs)


def _missed(tuning: Tuning, miss: NearMiss) -> str:
    """Return a line on a bound that few runs meet, with the run that comes nearest."""
    line = f"{miss.bound.text} holds for {miss.holds or 'none'} of {miss.settled} runs that settled"
    if miss.nearest is None:
        return line
    row = tuning.candidates[miss.candidate].tolist()
    at = ", ".join(tuning.runs.setting(key, v) for key, v in zip(tuning.keys, row, strict=True))
    nearest = number(miss.nearest * tuning.runs.factor(miss.measure))
    return f"{line}; the nearest: {tuning.runs.titled(miss.measure)} = {nearest} at {at}"


def _nothing_found(tuning: Tuning, scene_name: str) -> str:
    task = tuning.task
    share = f"{100 * task.share:g} % of the drives of no candidate have"
    drives = share if task.draws > 1 else "no run has"
    message = f"nothing found: {drives} settled and kept all bounds; widen the ranges or the bounds"
    if len(tuning.candidates) >= task.candidates:  # otherwise the search had converged
        message += ", or look at more (--runs)"
    if any("friction" in name for name in task.scene.effects):
        command = f"{own_command()} equilibria {shlex.quote(scene_name)}"
        message += f"; `{command}` shows where friction holds balls"
    return message


def _aim_text(metric: float | None, factor: float, inside: bool = True) -> str:
    """Return a metric's text; ``inside``: the drive has settled, and keeps all bounds."""
    value = number(None if metric is None else metric * factor)
    return value if inside else f"{value}, but it has not settled, or a bound does not hold"


_FINER = (0.01, 0.001)
"""Half-widths for which the necessary number of runs is printed."""
_HALF_WIDTH = "must be the half-width of the interval, e.g. 0.1%"


def robust_command(options: RobustOptions) -> Command:
    """Return the command that runs drives with manufacturing tolerances."""
    shown_units(options.units)
    executor = executor_of(options.workers, options.scheduler)
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
        until=None if options.until is None else share_of("until", options.until, _HALF_WIDTH),
        against=other,
    )
    if options.worst is not None:
        check_worst_folder(options.worst)

    def work(tell: Progress) -> Outcome:
        result = run_spread(scene, tolerances, question, executor, tell)
        spread = result.in_units(options.units)
        writes: dict[str, Write | None] = {
            "--parquet": result.write, "--csv": result.write, "--worst": result.write_worst
        }  # fmt: skip
        lines = _spread_shown(spread, options.scene, options.change)
        return Outcome(lines, result.report, picture("spread", spread), writes)

    outputs: list[Output] = [
        (options.parquet, PARQUET, "--parquet"), (options.csv, CSV, "--csv"),
        (options.worst, (), "--worst"),
    ]  # fmt: skip
    return Command(work, scene.name, KEPT, outputs)


def _named_by_file(scene: Scene, *words: str) -> Scene:
    """Return the scene with its file and changes in the name, to distinguish two designs."""
    return changed_scene(scene, {"name": f"{scene.name} ({' '.join(words)})"}, "against")


def _spread_shown(spread: Spread, scene_name: str, changes: Sequence[str]) -> Iterator[Table | str]:
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
    """Return a line on the numbers of runs for narrower intervals of the share."""
    share = spread.share
    finer = [share.half_width / 2.0, *(h for h in _FINER if h < share.half_width / 2.0)]
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
    """Return a quantile and its confidence interval as text, multiplied by a factor."""
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


def size_command(options: SizeOptions) -> Command:
    """Return the command that sizes a balancer."""
    executor = executor_of(options.workers, options.scheduler)
    must = "must be a share, e.g. 10%"
    texts = SpecificationTexts(
        options.mass, options.critical, options.speed, options.race_radius, options.race_width,
        options.unbalance, options.grade, options.damping_ratio, options.acceleration,
        options.settle, options.density, options.balls, friction_arm=options.friction_arm,
        share=share_of("share", options.share, must),
        residual=share_of("residual", options.residual, must),
        drag_tolerance=share_of("drag-tolerance", options.drag_tolerance, must),
    )  # fmt: skip
    specification = specification_of(texts)

    def work(tell: Progress) -> Outcome:
        sizing = run_sizing(specification, Running(options.runs, options.seed, executor, tell))
        return Outcome(
            _sizing_shown(sizing),
            sizing.report,
            picture("sizing", sizing),
            {"--scene": scene_writer(sizing.scene_text) if sizing.found else None},
            failure=sizing_failure(sizing) if sizing.chosen is None else None,
        )

    return Command(work, "size", KEPT, ((options.scene_file, SCENE, "--scene"),))


def _sizing_shown(sizing: Sizing) -> Iterator[Table | str]:
    yield _candidates(sizing)
    for candidate in sizing.candidates:
        if candidate.reason_unsuitable is not None:
            yield f"{candidate.count} balls: {candidate.reason_unsuitable}"
    for count, runs in sizing.tried:
        share = f"{100 * runs.share.value:.1f} %"
        yield f"{count} balls: enough by the prediction, but only {share} of the runs balance"
    if sizing.chosen is None:
        return
    yield _chosen(sizing, sizing.chosen)
    table = Table("claim", "predicted", "seen", "verdict", title="predictions and runs")
    for claim in sizing.claims:
        table.add_row(*claim)
    yield table


def _candidates(sizing: Sizing) -> Table:
    title = f"balls for up to {number(sizing.specification.largest_unbalance)} kg m"
    columns = "balls | of [g] | wide [mm] | circulate up to | drag from | to [N s/m] | in time"
    table = new_table("", columns, title=title)
    for candidate in sizing.candidates:
        balls, window = candidate.balls, candidate.window
        size = ("-", "-", "-")
        if balls is not None:
            size = f"{1e3 * balls.mass:.4g}", f"{2e3 * balls.radius:.3g}", f"{candidate.border:.3g}"
        ends = ("none", "") if window is None else (f"{window.low:.3g}", f"{window.high:.3g}")
        table.add_row(str(candidate.count), *size, *ends, f"{100 * candidate.predicted:.0f} %")
    return table


def _chosen(sizing: Sizing, chosen: SizedBalls) -> str:
    balls, hold = chosen.balls, sizing.hold
    assert balls is not None
    pause = "no hold" if hold is None else (
        f"a hold of {hold.duration:.3g} s at {hold.start_speed:.4g} rad/s"
    )  # fmt: skip
    return (
        f"take {chosen.count} balls of {1e3 * balls.mass:.4g} g, {2e3 * balls.radius:.3g} mm wide, "
        f"a drag of {number(chosen.drag)} N s/m, and {sizing.specification.acceleration:.4g} "
        f"rad/s^2 with {pause}"
    )
