"""Terminal display of a live run."""

import contextlib
import math
from collections.abc import Callable, Iterator

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from ab_sim.cli.live_run import LiveRun
from ab_sim.conventions import in_one_turn
from ab_sim.scene import Scene

Show = Callable[[LiveRun], None]


@contextlib.contextmanager
def live_display(console: Console, scene: Scene, duration: float) -> Iterator[Show]:
    """Show a bar with the drive's state, or without a terminal one line per second.

    The display includes the state of the profile controller with its reason.

    Args:
        console: console for the output.
        scene: scene of the run.
        duration: duration of the run, in simulated time [s].
    """

    def state(live: LiveRun) -> str:
        unit = scene.rotor.eccentricity
        whirl = f"W/e {live.whirl / unit:5.1f}" if unit else f"W {1e3 * live.whirl:6.3f} mm"
        balls = [f"{math.degrees(in_one_turn(angle)):7.1f}" for angle in live.ball_angles[:4]]
        more = [] if len(live.ball_angles) <= len(balls) else ["..."]
        told = ["balls", *balls, *more, "deg"] if balls else []
        return " ".join([f"{live.speed:6.1f} rad/s  ", f"{whirl}  ", *told])

    said = [0]

    def tell(live: LiveRun) -> None:
        for at, status in live.statuses[said[0] :]:
            console.print(f"{at:5.1f} s   {status}", soft_wrap=True)
        said[0] = len(live.statuses)

    if not console.is_terminal:
        printed = [-1]

        def show_line(live: LiveRun) -> None:
            tell(live)
            if int(live.elapsed) != printed[0]:  # decreases after a reset
                printed[0] = int(live.elapsed)
                done = min(live.elapsed, duration)
                console.print(f"{done:5.1f} of {duration:g} s   {state(live)}")

        yield show_line
        return
    columns = (
        BarColumn(),
        TextColumn("{task.completed:5.2f} of {task.total:g} s"),
        TextColumn("{task.fields[state]}"),
    )
    with Progress(*columns, console=console) as bar:
        task = bar.add_task("", total=duration, state="")

        def show(live: LiveRun) -> None:
            tell(live)
            bar.update(task, completed=min(live.elapsed, duration), state=state(live))

        yield show
