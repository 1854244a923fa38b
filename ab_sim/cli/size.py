"""`ab-sim size`."""

import functools
from collections.abc import Iterator

from rich.table import Table

from ab_sim.base.output_file import SCENE
from ab_sim.base.presentation import number
from ab_sim.base.progress import Progress
from ab_sim.base.workers import KEPT
from ab_sim.cli.checks import executor_of, share_of
from ab_sim.cli.design_commands import SizeOptions
from ab_sim.cli.runner import Command, Outcome, new_table, plotted, scene_writer
from ab_sim.design.sizing.drag_window import SizedBalls
from ab_sim.design.sizing.size import Sizing, run_sizing, sizing_failure
from ab_sim.design.sizing.specification import SpecificationTexts, specification_of
from ab_sim.design.sizing.spread_share import Running


def size_command(given: SizeOptions) -> Command:
    """Return the command that sizes a balancer."""
    executors = functools.partial(executor_of, given.workers, given.scheduler)
    executors()
    must = "must be a share, e.g. 10%"
    texts = SpecificationTexts(
        given.mass, given.critical, given.speed, given.race_radius, given.race_width,
        given.unbalance, given.grade, given.damping_ratio, given.acceleration, given.settle,
        given.density, given.balls, friction_arm=given.friction_arm,
        share=share_of("share", given.share, must), left=share_of("left", given.left, must),
        drag_tolerance=share_of("drag-tolerance", given.drag_tolerance, must),
    )  # fmt: skip
    specification = specification_of(texts)

    def work(tell: Progress) -> Outcome:
        sizing = run_sizing(specification, Running(given.runs, given.seed, executors, tell))
        return Outcome(
            _shown(sizing),
            sizing.report,
            plotted(sizing),
            {"--scene": scene_writer(sizing.scene_text) if sizing.found else None},
            failure=sizing_failure(sizing) if sizing.chosen is None else None,
        )

    return Command(work, "size", KEPT, ((given.scene_file, SCENE, "--scene"),))


def _shown(found: Sizing) -> Iterator[Table | str]:
    yield _candidates(found)
    for each in found.candidates:
        if each.why_not is not None:
            yield f"{each.count} balls: {each.why_not}"
    for count, runs in found.tried:
        yield f"{count} balls: predicted, but of runs only {100 * runs.share.value:.1f} % balance"
    if found.chosen is None:
        return
    yield _chosen(found, found.chosen)
    table = Table("claim", "predicted", "seen", "verdict", title="predictions, checked by runs")
    for claim in found.claims:
        table.add_row(*claim)
    yield table


def _candidates(found: Sizing) -> Table:
    title = f"balls for up to {number(found.specification.largest_unbalance)} kg m"
    columns = "balls | of [g] | wide [mm] | circulate up to | drag from | to [N s/m] | in time"
    table = new_table("", columns, title=title)
    for each in found.candidates:
        balls, window = each.balls, each.window
        size = ("-", "-", "-")
        if balls is not None:
            size = f"{1e3 * balls.mass:.4g}", f"{2e3 * balls.radius:.3g}", f"{each.border:.3g}"
        ends = ("none", "") if window is None else (f"{window.low:.3g}", f"{window.high:.3g}")
        table.add_row(str(each.count), *size, *ends, f"{100 * each.predicted:.0f} %")
    return table


def _chosen(found: Sizing, chosen: SizedBalls) -> str:
    balls, hold = chosen.balls, found.hold
    assert balls is not None
    pause = "no hold" if hold is None else (
        f"a hold of {hold.duration:.3g} s at {hold.start_speed:.4g} rad/s"
    )  # fmt: skip
    return (
        f"take {chosen.count} balls of {1e3 * balls.mass:.4g} g, {2e3 * balls.radius:.3g} mm wide, "
        f"a drag of {number(chosen.drag)} N s/m, and {found.specification.acceleration:.4g} "
        f"rad/s^2 with {pause}"
    )
