"""`ab-sim tune`."""

import functools
import shlex
from collections.abc import Iterator

from rich.table import Table

from ab_sim.base.errors import InputError
from ab_sim.base.output_file import PARQUET, SCENE
from ab_sim.base.presentation import number
from ab_sim.base.progress import Progress
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
from ab_sim.scene.shown_units import shown_units


def tune_command(given: TuneOptions) -> Command:
    """Return the command that finds the best values of keys."""
    shown_units(given.units)
    executor = executor_of(given.workers, given.scheduler)
    scene = load_scene(given.scene, given.change)
    spreading = Spreading(list(map(tolerance_of, given.spread)), given.draws, given.seed)
    standard = Standard(
        aim_of(given.minimise, given.maximise),
        tuple(map(bound_of, given.subject_to)),
        spreading.draws,
        _share(given.share) if given.spread else 1.0,
    )
    effort = Effort(given.runs // spreading.draws, given.seed)
    task = Task(scene, tuple(map(_range, given.vary)), standard, effort, spreading)

    def work(tell: Progress) -> Outcome:
        result = run_tuning(task, executor, tell)
        tuning = result.in_units(given.units)
        return Outcome(
            _shown(tuning),
            result.report,
            plotted(tuning),
            {
                "--scene": None if result.scene is None else scene_writer(result.scene_text),
                "--parquet": result.runs.write,
            },
            failure=_nothing_found(tuning, given.scene) if tuning.candidate is None else None,
        )

    outputs = ((given.best_scene, SCENE, "--scene"), (given.parquet, PARQUET, "--parquet"))
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


def _shown(found: Tuning) -> Iterator[Table | str]:
    counts = ", ".join(f"{name}: {count}" for name, count in found.runs.outcomes.items())
    inside, looked_at = int(found.scores.within.sum()), len(found.candidates)
    line = f"{looked_at} candidates, {inside} of them within all bounds; runs: {counts}"
    standard, draws = found.task.standard, found.task.spreading.draws
    if found.candidate is None:
        yield line
        yield from _left_out(found)
        yield from map(functools.partial(_missed, found), near_misses(found))
        return
    title = f"{found.runs.scene.name}: {standard.aim}"
    table = new_table("key", "best | from | to", title=title)
    for each in found.task.ranges:
        factor = found.runs.factor(each.key)
        cells = [number(x * factor) for x in (found.values[each.key], each.low, each.high)]
        table.add_row(found.runs.titled(each.key), *cells)
    yield table
    if draws > 1:
        yield f"of {draws} drives each, what {100 * standard.share:g} % of them reach:"
    factor = found.runs.factor(standard.aim.metric)
    verdict = "" if draws > 1 else f", {found.runs[OUTCOME][found.candidate]}"
    yield f"{found.runs.titled(standard.aim.metric)}: {_aim_text(found.best, factor)}{verdict}"
    if AS_IT_IS in found.as_good:
        yield "that is no better than the scene as it is"
    if NO_PERIOD in found.as_good:
        none = _aim_text(found.as_good[NO_PERIOD], factor)
        yield f"no variable-speed period at all is as good or better: {none}"
    for name, metric, inside_ in found.before:
        yield f"  the scene {name}: {_aim_text(metric, factor, inside_)}"
    for key, value, metric, inside_ in found.beside:
        yield f"  at {found.runs.setting(key, value)}: {_aim_text(metric, factor, inside_)}"
    if found.active:
        yield f"at its bounds, beyond which it may be better: {', '.join(found.active)}"
    yield line
    yield from _left_out(found)


def _left_out(found: Tuning) -> Iterator[str]:
    """Yield lines on candidates that do not count, with reasons."""
    for name, (count, better) in found.left_out.items():
        ahead = f", {better} of them better at their end than the best" if better else ""
        yield f"left out: {count} candidates, {name}{ahead}"
    yield from outcome_notes(found.runs)


def _missed(found: Tuning, miss: NearMiss) -> str:
    line = f"{miss.bound.text} holds for {miss.holds or 'none'} of {miss.settled} runs that settled"
    if miss.nearest is None:
        return line
    row = found.candidates[miss.candidate].tolist()
    at = ", ".join(found.runs.setting(key, v) for key, v in zip(found.keys, row, strict=True))
    nearest = number(miss.nearest * found.runs.factor(miss.measure))
    return f"{line}; the nearest: {found.runs.titled(miss.measure)} = {nearest} at {at}"


def _nothing_found(found: Tuning, scene_name: str) -> str:
    task = found.task
    share = f"{100 * task.standard.share:g} % of the drives of no candidate have"
    drives = share if task.spreading.draws > 1 else "no run has"
    message = f"nothing found: {drives} settled and kept all bounds; widen the ranges or the bounds"
    if len(found.candidates) >= task.effort.candidates:  # otherwise the search has ended by itself
        message += ", or look at more (--runs)"
    if any("friction" in name for name in task.scene.effects):
        command = f"{own_command()} equilibria {shlex.quote(scene_name)}"
        message += f"; `{command}` says where friction holds balls"
    return message


def _aim_text(metric: float | None, factor: float, inside: bool = True) -> str:
    value = number(None if metric is None else metric * factor)
    return value if inside else f"{value}, but it has not settled, or a bound does not hold"
