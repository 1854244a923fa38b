"""`ab-sim size`."""

import functools
from collections.abc import Iterator, Mapping
from pathlib import Path

from rich.table import Table

from ab_sim.cli.outputs import write_scene
from ab_sim.cli.progress import Tell
from ab_sim.cli.runner import Command, Outcome, plotted
from ab_sim.cli.sharing import executor_of
from ab_sim.cli.words import share_of
from ab_sim.design.sizing.drag_window import SizedBalls
from ab_sim.design.sizing.size import Sizing, run_sizing, sizing_failure
from ab_sim.design.sizing.specification import SpecificationTexts, specification_of
from ab_sim.design.sizing.spread_share import Running
from ab_sim.output_file import SCENE
from ab_sim.presentation import number
from ab_sim.workers import KEPT


def size_command(
    given: SpecificationTexts,
    shares: Mapping[str, str],
    drawn: tuple[int, int],
    shared: tuple[int | None, str | None],
    file: Path | None,
) -> Command:
    """Return the command that sizes a balancer.

    Args:
        given: specification without the shares.
        shares: wanted share, residual share and tolerance of the drag, in % or as numbers, by
            option.
        drawn: runs and seed.
        shared: workers and scheduler, see ``executor_of``.
        file: file for the scene.
    """
    executors = functools.partial(executor_of, *shared)
    executors()
    share, left, tolerance = (
        share_of(option, text, "must be a share, e.g. 10%") for option, text in shares.items()
    )
    numbers = given._replace(share=share, left=left, drag_tolerance=tolerance)
    specification = specification_of(numbers)

    def work(tell: Tell) -> Outcome:
        found = run_sizing(specification, Running(*drawn, executors, tell))

        def write() -> None:
            if file is not None and found.found:
                write_scene(found.scene_text(), file)

        draw = plotted(found)
        missing = () if file is None or found.found else (file,)
        failure = sizing_failure(found) if found.chosen is None else None
        return Outcome(_shown(found), found.report, draw, (write,), (), missing, failure)

    return Command(work, "size", KEPT, ((file, SCENE, "--scene"),))


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
    table = Table(title="what is claimed, and what runs say")
    for name in ("claim", "predicted", "seen", "verdict"):
        table.add_column(name)
    for claim in found.claims:
        table.add_row(*claim)
    yield table


def _candidates(found: Sizing) -> Table:
    table = Table(title=f"balls for up to {number(found.specification.largest_unbalance)} kg m")
    for name in ("balls", "of [g]", "wide [mm]", "circulate up to", "drag from", "to [N s/m]",
                 "in time"):  # fmt: skip
        table.add_column(name, justify="right")
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
