"""`ab-sim accuracy` and `ab-sim cost`."""

from collections.abc import Iterator
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.table import Table

from ab_sim.analysis.accuracy_cost import AccuracyCost, SettingCost, accuracy_cost
from ab_sim.analysis.effect_cost import EffectCost, VariantCost, effect_cost
from ab_sim.base.errors import InputError
from ab_sim.base.presentation import Progress
from ab_sim.cli.runner import FINE, Command, Outcome, new_table, picture
from ab_sim.cli.scene_commands import AccuracyOptions, CostOptions
from ab_sim.scene import load_scene

_NARROW: dict[str, Any] = {"box": SIMPLE_HEAD, "show_edge": False, "padding": 0}
"""Style of tables that fit into 80 columns."""
_WANTED = (1e-3, 1e-6, 1e-9, 1e-12)
"""Errors [rad] for which the cheapest setting is named."""


def accuracy_command(options: AccuracyOptions) -> Command:
    """Return the command that measures the cost of an accuracy."""
    _check_repeats(options.repeats)
    scene = load_scene(options.scene, options.change)

    def work(tell: Progress) -> Outcome:
        cost = accuracy_cost(scene, options.repeats, progress=tell)
        draw = picture("accuracy_cost", cost, dots=FINE)
        return Outcome(accuracy_shown(cost, options.quartiles), cost.report, draw)

    return Command(work, scene.name)


def accuracy_shown(cost: AccuracyCost, quartiles: bool = False) -> Iterator[Table | str]:
    """Yield the tables of costs, then notes on the reference and on omitted methods."""
    yield accuracy_table(cost, quartiles)
    yield _cheapest_table(cost)
    apart = cost.uncertainty
    unit = cost.unit
    yield f"effects: {', '.join(cost.effects) or 'none'}"
    yield f"reference: {cost.reference}"
    shared = ", ".join(cost.reference_shares)
    if cost.independent:
        yield f"it is independent: with ab_sim's steppers, it shares only the {shared}"
    else:
        yield (
            f"it is not independent: with ab_sim's steppers, it shares the {shared}; tests of "
            "ab_sim compare them with another simulator"
        )
    yield (
        f"its uncertainty: {apart.angle:.1e} rad, {apart.whirl:.1e} {unit}, the largest difference "
        "between two such integrations; errors of the equations are not included"
    )
    yield f"setting in the scene: {cost.as_scene_says}"
    for row in cost.rows:
        if row.failure:
            yield f"unstable: {row.method} at {row.setting}: {row.failure}"
    reasons: dict[str, list[str]] = {}
    for omission in cost.omitted:
        reasons.setdefault(omission.reason, []).append(omission.method)
    for reason, methods in reasons.items():
        yield f"left out: {', '.join(methods)}: {reason}"
    yield from cost.notes


def accuracy_table(cost: AccuracyCost, quartiles: bool = False) -> Table:
    """Return the table of all rows, the most accurate first."""
    balls = f"{cost.balls} ball{'' if cost.balls == 1 else 's'}"
    unit = cost.unit
    reference_period, others = 1e3 * cost.reference_period, 1e3 * cost.period
    table = new_table(
        "method | setting",
        f"ms/s{' | quartiles' if quartiles else ''} | angle [rad] | at end | whirl [{unit}] | "
        "at end | energy",
        no_wrap=True,
        **_NARROW,
        title=f"{cost.scene}: {balls}, {cost.duration:g} s, {cost.repeats} interleaved repeats",
        caption="* no other setting is both cheaper and more accurate; < below the reference's "
        "uncertainty; ms/s: median CPU time of the thread per simulated second, without compiling; "
        "10 ms/s are 1 % of a core; errors: the largest at the ends of steps, at most every "
        f"{reference_period:g} ms; of peers, every {others:g} ms",
    )
    front = cost.front()
    for row in cost.by_error():
        table.add_row(*_cells(row, bool(cost.balls), row in front, quartiles))
    return table


def _cheapest_table(cost: AccuracyCost) -> Table:
    """Return the table of the cheapest settings of ab_sim and of its peers, by error."""
    what = "ball angle [rad]" if cost.balls else f"whirl [{cost.unit}]"
    title = f"cheapest tried settings with an error in {what} of at most"
    columns = "error | ab_sim | CPU [ms/s] | best peer | CPU [ms/s] | peer / ab_sim"
    table = new_table("", columns, title=title, **_NARROW)
    for error in _WANTED:
        ours, peer = cost.cheapest(error, peer=False), cost.cheapest(error, peer=True)
        ratio = ""
        if ours and peer and ours.cpu and peer.cpu:
            ratio = f"{peer.cpu.median / ours.cpu.median:.0f}"
        table.add_row(f"{error:g}", *_choice(ours), *_choice(peer), ratio)
    return table


def _choice(row: SettingCost | None) -> tuple[str, str]:
    if row is None or row.cpu is None:
        return "-", "-"
    return f"{row.method} at {row.setting}", f"{1e3 * row.cpu.median:.3g}"


def _cells(row: SettingCost, balls: bool, best: bool, quartiles: bool) -> list[str]:
    assert row.errors is not None and row.cpu is not None
    errors, time = row.errors, row.cpu
    angles = [_short(errors.angle), _short(errors.angle_end)] if balls else ["-", "-"]
    return [
        f"{'*' if best else ' '} {row.method}",
        row.setting,
        f"{1e3 * time.median:.3g}",
        *([f"{1e3 * time.lower:.3g} to {1e3 * time.upper:.3g}"] if quartiles else []),
        *angles,
        _short(errors.whirl),
        _short(errors.whirl_end),
        "-" if errors.energy is None else f"{errors.energy:.0e}",
    ]


def _short(error: object) -> str:
    return str(error).replace("<= ", "<")


def _check_repeats(repeats: int) -> None:
    if repeats < 1:
        raise InputError(f"--repeats {repeats}: must be at least 1")


def cost_command(options: CostOptions) -> Command:
    """Return the command that measures the cost of each effect of a scene."""
    _check_repeats(options.repeats)
    scene = load_scene(options.scene, options.change)

    def work(tell: Progress) -> Outcome:
        cost = effect_cost(
            scene, options.repeats, leave_one_out=options.leave_one_out, progress=tell
        )
        draw = picture("effect_cost", cost, dots=FINE)
        return Outcome([cost_table(cost, options.quartiles)], cost.report, draw)

    return Command(work, scene.name)


def cost_table(cost: EffectCost, quartiles: bool = False) -> Table:
    """Return the table of costs."""
    table = new_table(
        "effects",
        f"ns per step{' | quartiles' if quartiles else ''} | of base | events | first step [s]",
        **_NARROW,
        title=f"{cost.scene}: {cost.balls} balls, {cost.stepper} at {cost.step:g} s, "
        f"{cost.steps_per_run} steps, {cost.repeats} interleaved repeats",
        caption="time: median CPU time of the thread; events: per 1000 steps; first step: from the "
        "scene to its first step, machine code included",
    )
    for row in cost.rows:
        table.add_row(*_cost_cells(row, quartiles))
    return table


def _cost_cells(row: VariantCost, quartiles: bool) -> list[str]:
    name = row.name + (f" (with {', '.join(row.added)})" if row.added else "")
    first = f"{row.first_seconds:.2f}"
    if row.ns_per_step is None or row.ratio is None:
        blank = [""] * (4 if quartiles else 3)
        return [f"{name}: cannot run: {row.failure}", *blank, first]
    time = row.ns_per_step
    return [
        name,
        f"{time.median:.0f}",
        *([f"{time.lower:.0f} to {time.upper:.0f}"] if quartiles else []),
        f"{row.ratio.median:.3f}",
        f"{row.events_per_1000_steps:.1f}",
        first,
    ]
