"""`ab-sim accuracy`."""

from collections.abc import Iterator

from rich.table import Table

from ab_sim.cli.progress import Tell
from ab_sim.cli.runner import Command, Outcome, picture
from ab_sim.errors import InputError
from ab_sim.scene import load_scene
from ab_sim.studies.accuracy_cost import AccuracyCost, SettingCost, accuracy_cost

WANTED = (1e-3, 1e-6, 1e-9, 1e-12)
"""Errors [rad] for which the cheapest setting is named."""


def accuracy_command(scene_name: str, changes: list[str], repeats: int) -> Command:
    """Return the command that measures the cost of an accuracy."""
    if repeats < 1:
        raise InputError(f"--repeats {repeats}: must be at least 1")
    scene = load_scene(scene_name, changes)

    def work(tell: Tell) -> Outcome:
        cost = accuracy_cost(scene, repeats, progress=tell)
        draw = picture("ab_sim.figures.accuracy_cost:accuracy_figure", cost)
        return Outcome(accuracy_shown(cost), cost.report, draw)

    return Command(work, scene.name)


def accuracy_shown(cost: AccuracyCost) -> Iterator[Table | str]:
    """Yield the tables, then their basis and limits."""
    yield accuracy_table(cost)
    yield cheapest_table(cost)
    apart = cost.uncertainty
    unit = cost.unit
    yield f"effects: {', '.join(cost.effects) or 'none'}"
    yield f"reference: {cost.reference}"
    shared = ", ".join(cost.reference_shares)
    if cost.independent:
        yield f"it is independent: what it shares with ab_sim's steppers is the {shared}"
    else:
        yield (
            f"it is not independent: it shares with what it judges the {shared}; ab_sim's tests "
            "compare those with another simulator"
        )
    yield (
        f"its uncertainty: {apart.angle:.1e} rad, {apart.whirl:.1e} {unit}, by which the two "
        "differ at most; of the integration, not of the equations"
    )
    yield f"the scene itself takes {cost.as_scene_says}"
    for row in cost.rows:
        if row.failure:
            yield f"unstable: {row.method} at {row.setting}: {row.failure}"
    reasons: dict[str, list[str]] = {}
    for each in cost.omitted:
        reasons.setdefault(each.reason, []).append(each.method)
    for reason, methods in reasons.items():
        yield f"left out: {', '.join(methods)}: {reason}"
    yield from cost.notes


def accuracy_table(cost: AccuracyCost) -> Table:
    """Return the table of all rows, the most accurate first."""
    balls = f"{cost.balls} ball{'' if cost.balls == 1 else 's'}"
    unit = cost.unit
    own, others = 1e3 * cost.reference_period, 1e3 * cost.period
    table = Table(
        title=f"{cost.scene}: {balls}, {cost.duration:g} s, {cost.repeats} interleaved repeats",
        caption="* no other is both cheaper and more accurate; <= the reference knows no better; "
        "CPU time: median (quartiles) of the thread, per simulated second, without compiling; "
        f"errors: the largest at the ends of steps, at most every {own:g} ms; of peers, every "
        f"{others:g} ms",
    )
    table.add_column("")
    table.add_column("method")
    for name in (
        "setting", "CPU [ms/s]", "of a core", "angle [rad]", "at the end", f"whirl [{unit}]",
        "at the end", "energy",
    ):  # fmt: skip
        table.add_column(name, justify="right")
    front = cost.front()
    for row in cost.by_error():
        table.add_row("*" if row in front else "", *_cells(row, bool(cost.balls)))
    return table


def cheapest_table(cost: AccuracyCost) -> Table:
    """Return the table of the cheapest setting of the package and of the best peer, by error."""
    what = "ball angle [rad]" if cost.balls else f"whirl [{cost.unit}]"
    table = Table(title=f"cheapest of what was tried, for an error in {what} of at most")
    for name in ("error", "ab_sim", "CPU [ms/s]", "best peer", "CPU [ms/s]", "peer / ab_sim"):
        table.add_column(name, justify="right")
    for error in WANTED:
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


def _cells(row: SettingCost, balls: bool) -> list[str]:
    assert row.errors is not None and row.cpu is not None
    errors, time = row.errors, row.cpu
    angles = [str(errors.angle), str(errors.angle_end)] if balls else ["-", "-"]
    return [
        row.method,
        row.setting,
        f"{1e3 * time.median:.3g} ({1e3 * time.lower:.3g} .. {1e3 * time.upper:.3g})",
        f"{100.0 * time.median:.2g} %",
        *angles,
        str(errors.whirl),
        str(errors.whirl_end),
        "-" if errors.energy is None else f"{errors.energy:.0e}",
    ]
