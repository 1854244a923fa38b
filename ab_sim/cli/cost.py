"""`ab-sim cost`."""

from pathlib import Path

from rich.table import Table

from ab_sim.cli.outputs import check_outputs, console_beside, say_written, write_json
from ab_sim.cli.progress import progress_bar
from ab_sim.errors import InputError
from ab_sim.scene import Scene, load_scene
from ab_sim.studies.effect_cost import EffectCost, VariantCost, measure


def cost_command(
    scene_name: str,
    changes: list[str],
    repeats: int,
    leave_one_out: bool,
    json: str | None,
    plot: Path | None,
) -> None:
    """Measure, print, and write what was asked for; outputs are tried first."""
    if repeats < 1:
        raise InputError(f"--repeats {repeats}: must be at least 1")
    scene = load_scene(scene_name, changes)
    files = check_outputs(json, plot)
    cost = measure_with_progress(scene, repeats, leave_one_out)
    if json is not None:
        write_json(cost.report(), json)
    if plot is not None:
        from ab_sim.figures.effect_cost import cost_figure

        cost_figure([cost], plot)
    console_beside(json).print(cost_table(cost))
    say_written(files)


def measure_with_progress(scene: Scene, repeats: int, leave_one_out: bool = False) -> EffectCost:
    """``measure``, which takes a while when kernels have to be compiled, with a bar."""
    with progress_bar(scene.name) as update:
        return measure(scene, repeats, leave_one_out, update)


def cost_table(cost: EffectCost) -> Table:
    """The table for people."""
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
