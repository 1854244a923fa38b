"""`ab-sim cost`."""

from rich.table import Table

from ab_sim.cli.progress import Tell
from ab_sim.cli.runner import Command, Outcome, picture
from ab_sim.errors import InputError
from ab_sim.scene import load_scene
from ab_sim.studies.effect_cost import EffectCost, VariantCost, effect_cost


def cost_command(scene_name: str, changes: list[str], repeats: int, leave_one_out: bool) -> Command:
    """Return the command that measures the cost of each effect of a scene."""
    if repeats < 1:
        raise InputError(f"--repeats {repeats}: must be at least 1")
    scene = load_scene(scene_name, changes)

    def work(tell: Tell) -> Outcome:
        cost = effect_cost(scene, repeats, leave_one_out=leave_one_out, progress=tell)
        draw = picture("ab_sim.figures.effect_cost:cost_figure", [cost])
        return Outcome([cost_table(cost)], cost.report, draw)

    return Command(work, scene.name)


def cost_table(cost: EffectCost) -> Table:
    """Return the table of costs."""
    table = Table(
        title=f"{cost.scene}: {cost.balls} balls, {cost.stepper} at {cost.step:g} s, "
        f"{cost.steps_per_run} steps, {cost.repeats} interleaved repeats",
        caption="time: median (quartiles), CPU time of the thread; first step: from the scene to "
        "its first step, machine code included",
    )
    for name in ("effects", "ns per step", "of base", "events per 1000", "first step [s]"):
        table.add_column(name, justify="left" if name == "effects" else "right")
    for row in cost.rows:
        table.add_row(*_cells(row))
    return table


def _cells(row: VariantCost) -> list[str]:
    name = row.name + (f" (with {', '.join(row.added)})" if row.added else "")
    first = f"{row.first_seconds:.2f}"
    if row.ns_per_step is None or row.ratio is None:
        return [f"{name}: cannot run: {row.failure}", "", "", "", first]
    time = row.ns_per_step
    return [
        name,
        f"{time.median:.0f} ({time.lower:.0f} .. {time.upper:.0f})",
        f"{row.ratio.median:.3f}",
        f"{row.events_per_1000_steps:.1f}",
        first,
    ]
