"""`ab-sim tune`."""

import functools
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from rich.table import Table

from ab_sim.cli.outputs import write_scene
from ab_sim.cli.own_command import own_command
from ab_sim.cli.progress import Tell
from ab_sim.cli.runner import Command, Outcome, plotted
from ab_sim.cli.sharing import executor_of
from ab_sim.cli.words import outcome_notes
from ab_sim.design.bounds import bound_of
from ab_sim.design.candidates import Spreading
from ab_sim.design.judged import OUTCOME
from ab_sim.design.near_misses import NearMiss, near_misses
from ab_sim.design.scores import Standard
from ab_sim.design.search import Effort
from ab_sim.design.tolerances import tolerance_of
from ab_sim.design.tune import AS_IT_IS, NO_PERIOD, Task, Tuning, aim_of, run_tuning
from ab_sim.design.variables import Range, variable_of
from ab_sim.errors import InputError
from ab_sim.output_file import PARQUET, SCENE
from ab_sim.presentation import number
from ab_sim.scene import load_scene
from ab_sim.scene.shown_units import shown_units
from ab_sim.workers import KEPT


class Wanted(NamedTuple):
    """Options of `ab-sim tune`, as texts."""

    vary: list[str]
    minimise: str | None
    maximise: str | None
    subject_to: list[str]
    spread: list[str]
    draws: int
    share: str
    runs: int
    seed: int
    units: str


def tune_command(
    scene_name: str,
    changes: list[str],
    wanted: Wanted,
    shared: tuple[int | None, str | None],
    files: tuple[Path | None, Path | None],
) -> Command:
    """Return the command that finds the best values of keys.

    Args:
        scene_name, changes: see ``load_scene``.
        wanted: objective, limits and effort.
        shared: workers and scheduler, see ``executor_of``.
        files: files for the best scene, and for all runs.
    """
    shown_units(wanted.units)
    executor = executor_of(*shared)
    scene = load_scene(scene_name, changes)
    spreading = Spreading(list(map(tolerance_of, wanted.spread)), wanted.draws, wanted.seed)
    standard = Standard(
        aim_of(wanted.minimise, wanted.maximise),
        tuple(map(bound_of, wanted.subject_to)),
        spreading.draws,
        _share(wanted.share) if wanted.spread else 1.0,
    )
    task = Task(
        scene,
        tuple(_range(each) for each in wanted.vary),
        standard,
        Effort(wanted.runs // spreading.draws, wanted.seed),
        spreading,
    )
    best, table = files

    def work(tell: Tell) -> Outcome:
        found = run_tuning(task, executor, tell)

        def write_table() -> None:
            if table is not None:
                found.runs.write(table)

        def write_best() -> None:
            if best is not None and found.scene is not None:
                write_scene(found.scene_text(), best)

        shown = found.in_units(wanted.units)
        missing = () if best is None or found.scene is not None else (best,)
        failure = _nothing_found(shown, scene_name) if shown.candidate is None else None
        draw = plotted(shown)
        writes = (write_table, write_best)
        return Outcome(_shown(shown), found.report, draw, writes, (), missing, failure)

    outputs = ((best, SCENE, "--scene"), (table, PARQUET, "--parquet"))
    return Command(work, scene.name, KEPT, outputs)


def _range(text: str) -> Range:
    found = variable_of(text)
    if not isinstance(found, Range):
        raise InputError(f"--vary {text}: must be a range, {found.key}=FROM..TO")
    return found


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
    said = f"{looked_at} candidates, {inside} of them within all bounds; runs: {counts}"
    standard, draws = found.task.standard, found.task.spreading.draws
    if found.candidate is None:
        yield said
        yield from _left_out(found)
        yield from map(functools.partial(_missed, found), near_misses(found))
        return
    table = Table(title=f"{found.runs.scene.name}: {standard.aim}")
    for name in ("key", "best", "from", "to"):
        table.add_column(name, justify="left" if name == "key" else "right")
    for each in found.task.ranges:
        factor = found.runs.factor(each.key)
        cells = [number(x * factor) for x in (found.values[each.key], each.low, each.high)]
        table.add_row(found.runs.titled(each.key), *cells)
    yield table
    if draws > 1:
        yield f"of {draws} drives each, what {100 * standard.share:g} % of them reach:"
    factor = found.runs.factor(standard.aim.merit)
    verdict = "" if draws > 1 else f", {found.runs[OUTCOME][found.candidate]}"
    yield f"{found.runs.titled(standard.aim.merit)}: {_aim_text(found.best, factor)}{verdict}"
    if AS_IT_IS in found.as_good:
        yield "that is no better than the scene as it is"
    if NO_PERIOD in found.as_good:
        none = _aim_text(found.as_good[NO_PERIOD], factor)
        yield f"no variable-speed period at all is as good or better: {none}"
    for name, merit, inside_ in found.before:
        yield f"  the scene {name}: {_aim_text(merit, factor, inside_)}"
    for key, value, merit, inside_ in found.beside:
        yield f"  at {found.runs.setting(key, value)}: {_aim_text(merit, factor, inside_)}"
    if found.active:
        yield f"at its bounds, beyond which it may be better: {', '.join(found.active)}"
    yield said
    yield from _left_out(found)


def _left_out(found: Tuning) -> Iterator[str]:
    """Yield lines on candidates that do not count, with reasons."""
    for name, (count, better) in found.left_out.items():
        ahead = f", {better} of them better at their end than the best" if better else ""
        yield f"left out: {count} candidates, {name}{ahead}"
    yield from outcome_notes(found.runs)


def _missed(found: Tuning, miss: NearMiss) -> str:
    said = f"{miss.bound.text} holds for {miss.holds or 'none'} of {miss.settled} runs that settled"
    if miss.nearest is None:
        return said
    row = found.candidates[miss.candidate].tolist()
    at = ", ".join(found.runs.setting(key, v) for key, v in zip(found.keys, row, strict=True))
    nearest = number(miss.nearest * found.runs.factor(miss.measure))
    return f"{said}; the nearest: {found.runs.titled(miss.measure)} = {nearest} at {at}"


def _nothing_found(found: Tuning, scene_name: str) -> str:
    task = found.task
    share = f"no {100 * task.standard.share:g} % of drives"
    drives = share if task.spreading.draws > 1 else "no run"
    said = f"nothing found: {drives} settled within all bounds; widen the ranges or the bounds"
    if len(found.candidates) >= task.effort.candidates:  # otherwise the search has ended by itself
        said += ", or look at more (--runs)"
    if any("friction" in name for name in task.scene.effects):
        command = f"{own_command()} equilibria {shlex.quote(scene_name)}"
        said += f"; `{command}` says where friction holds balls"
    return said


def _aim_text(merit: float | None, factor: float, inside: bool = True) -> str:
    said = number(None if merit is None else merit * factor)
    return said if inside else f"{said}, not settled within all bounds"
