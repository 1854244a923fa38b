"""`ab-sim size`."""

import functools
from collections.abc import Iterator

from rich.table import Table

from ab_sim.base.files import SCENE
from ab_sim.base.presentation import Progress, number
from ab_sim.base.workers import KEPT
from ab_sim.cli.checks import executor_of, share_of
from ab_sim.cli.design_commands import SizeOptions
from ab_sim.cli.runner import Command, Outcome, new_table, plotted, scene_writer
from ab_sim.design.sizing.drag_window import SizedBalls
from ab_sim.design.sizing.size import Sizing, run_sizing, sizing_failure
from ab_sim.design.sizing.specification import SpecificationTexts, specification_of
from ab_sim.design.sizing.spread_share import Running


def size_command(options: SizeOptions) -> Command:
    """Return the command that sizes a balancer."""
    executors = functools.partial(executor_of, options.workers, options.scheduler)
    executors()
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
        sizing = run_sizing(specification, Running(options.runs, options.seed, executors, tell))
        return Outcome(
            _shown(sizing),
            sizing.report,
            plotted(sizing),
            {"--scene": scene_writer(sizing.scene_text) if sizing.found else None},
            failure=sizing_failure(sizing) if sizing.chosen is None else None,
        )

    return Command(work, "size", KEPT, ((options.scene_file, SCENE, "--scene"),))


def _shown(sizing: Sizing) -> Iterator[Table | str]:
    yield _candidates(sizing)
    for candidate in sizing.candidates:
        if candidate.why_not is not None:
            yield f"{candidate.count} balls: {candidate.why_not}"
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
