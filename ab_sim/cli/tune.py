"""`ab-sim tune`."""

import functools
import shlex
from collections.abc import Iterator

from rich.table import Table

from ab_sim.base.errors import InputError
from ab_sim.base.files import PARQUET, SCENE
from ab_sim.base.presentation import Progress, number
from ab_sim.base.workers import KEPT
from ab_sim.cli.checks import executor_of, outcome_notes
from ab_sim.cli.design_commands import TuneOptions
from ab_sim.cli.outputs import own_command
from ab_sim.cli.runner import Command, Outcome, new_table, plotted, scene_writer
from ab_sim.design.bounds import bound_of
from ab_sim.design.candidates import Spreading
from ab_sim.design.judged import OUTCOME
from ab_sim.design.near_misses import NearMiss, near_misses
from ab_sim.design.scores import Standard
from ab_sim.design.search import Effort
from ab_sim.design.tolerances import tolerance_of
from ab_sim.design.tune import AS_IT_IS, NO_PERIOD, Task, Tuning, aim_of, run_tuning
from ab_sim.design.variables import Range, variable_of
from ab_sim.scene import load_scene
from ab_sim.scene.units import shown_units


def tune_command(options: TuneOptions) -> Command:
    """Return the command that optimises values of a scene within limits."""
    shown_units(options.units)
    executor = executor_of(options.workers, options.scheduler)
    scene = load_scene(options.scene, options.change)
    spreading = Spreading(list(map(tolerance_of, options.spread)), options.draws, options.seed)
    standard = Standard(
        aim_of(options.minimise, options.maximise),
        tuple(map(bound_of, options.subject_to)),
        spreading.draws,
        _share(options.share) if options.spread else 1.0,
    )
    effort = Effort(options.runs // spreading.draws, options.seed)
    task = Task(scene, tuple(map(_range, options.vary)), standard, effort, spreading)

    def work(tell: Progress) -> Outcome:
        result = run_tuning(task, executor, tell)
        tuning = result.in_units(options.units)
        return Outcome(
            _shown(tuning),
            result.report,
            plotted(tuning),
            {
                "--scene": None if result.scene is None else scene_writer(result.scene_text),
                "--parquet": result.runs.write,
            },
            failure=_nothing_found(tuning, options.scene) if tuning.candidate is None else None,
        )

    outputs = ((options.best_scene, SCENE, "--scene"), (options.parquet, PARQUET, "--parquet"))
    return Command(work, scene.name, KEPT, outputs)


def _range(text: str) -> Range:
    variable = variable_of(text)
    if not isinstance(variable, Range):
        raise InputError(f"--vary {text}: must be a range, {variable.key}=FROM..TO")
    return variable


def _share(text: str) -> float:
    number_, percent, rest = text.strip().partition("%")
    try:
        share = float(number_) / 100.0
    except ValueError:
        share = -1.0
    if not percent or rest or not 0.0 < share <= 1.0:
        raise InputError(f"--share {text}: must be above 0 %, at most 100 %, e.g. 90%")
    return share


def _shown(tuning: Tuning) -> Iterator[Table | str]:
    counts = ", ".join(f"{name}: {count}" for name, count in tuning.runs.outcomes.items())
    inside, looked_at = int(tuning.scores.within.sum()), len(tuning.candidates)
    line = f"{looked_at} candidates, {inside} of them within all bounds; runs: {counts}"
    standard, draws = tuning.task.standard, tuning.task.spreading.draws
    if tuning.candidate is None:
        yield line
        yield from _left_out(tuning)
        yield from map(functools.partial(_missed, tuning), near_misses(tuning))
        return
    title = f"{tuning.runs.scene.name}: {standard.aim}"
    table = new_table("key", "best | from | to", title=title)
    for range_ in tuning.task.ranges:
        factor = tuning.runs.factor(range_.key)
        cells = [number(x * factor) for x in (tuning.values[range_.key], range_.low, range_.high)]
        table.add_row(tuning.runs.titled(range_.key), *cells)
    yield table
    if draws > 1:
        yield f"value that {100 * standard.share:g} % of a candidate's {draws} drives reach:"
    factor = tuning.runs.factor(standard.aim.metric)
    verdict = "" if draws > 1 else f", {tuning.runs[OUTCOME][tuning.candidate]}"
    yield f"{tuning.runs.titled(standard.aim.metric)}: {_aim_text(tuning.best, factor)}{verdict}"
    if AS_IT_IS in tuning.as_good:
        yield "this is no better than the scene as it is"
    if NO_PERIOD in tuning.as_good:
        none = _aim_text(tuning.as_good[NO_PERIOD], factor)
        yield f"without a variable-speed period, the scene is as good or better: {none}"
    for name, metric, inside_ in tuning.before:
        yield f"  the scene {name}: {_aim_text(metric, factor, inside_)}"
    for key, value, metric, inside_ in tuning.beside:
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
    line = f"{miss.bound.text} holds for {miss.holds or 'none'} of {miss.settled} runs that settled"
    if miss.nearest is None:
        return line
    row = tuning.candidates[miss.candidate].tolist()
    at = ", ".join(tuning.runs.setting(key, v) for key, v in zip(tuning.keys, row, strict=True))
    nearest = number(miss.nearest * tuning.runs.factor(miss.measure))
    return f"{line}; the nearest: {tuning.runs.titled(miss.measure)} = {nearest} at {at}"


def _nothing_found(tuning: Tuning, scene_name: str) -> str:
    task = tuning.task
    share = f"{100 * task.standard.share:g} % of the drives of no candidate have"
    drives = share if task.spreading.draws > 1 else "no run has"
    message = f"nothing found: {drives} settled and kept all bounds; widen the ranges or the bounds"
    if len(tuning.candidates) >= task.effort.candidates:  # otherwise the search had converged
        message += ", or look at more (--runs)"
    if any("friction" in name for name in task.scene.effects):
        command = f"{own_command()} equilibria {shlex.quote(scene_name)}"
        message += f"; `{command}` shows where friction holds balls"
    return message


def _aim_text(metric: float | None, factor: float, inside: bool = True) -> str:
    value = number(None if metric is None else metric * factor)
    return value if inside else f"{value}, but it has not settled, or a bound does not hold"
