"""Terminal and viewer of a live run: messages, progress, and waits for a browser."""

import contextlib
import math
import os
import select
import shlex
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from rich.progress import BarColumn, Progress, TextColumn

from ab_sim.base.errors import InputError, Interrupted
from ab_sim.base.presentation import in_one_turn
from ab_sim.cli.outputs import PlainConsole, own_command
from ab_sim.scene import Scene
from ab_sim.show.viewing import SHOWING, WEB, check_view, screens

if TYPE_CHECKING:
    from ab_sim.cli.live_run import LiveRun

console = PlainConsole()
NOWHERE = "none"
"""Value of ``--view`` without a viewer."""
Show = Callable[["LiveRun"], None]
GLANCE = 0.1
"""Time between two checks for a page or for Enter [s]."""


def check_view_option(view: str) -> None:
    """Refuse a ``--view`` that cannot show anything.

    Raises:
        InputError: the viewer is not available; the message lists the allowed ones.
    """
    if view == NOWHERE:
        return
    try:
        check_view(view, screen=True)
    except InputError as error:
        raise InputError(f"--view {error}; or {NOWHERE}") from error


def recorder_parameters(record: Path | None, view: str) -> dict[str, str] | None:
    """Return the recorder's parameters; None: no recorder is needed."""
    if record is None and view == NOWHERE:
        return None
    return {"view": view} if record is None else {"path": str(record), "view": view}


def start_run(live: "LiveRun", view: str, now: bool) -> None:
    """Print the viewer's address, or why there is none, and start the run.

    With a web page, wait for a browser first, except if ``now`` is set.
    """
    recorder = live.health("recorder")
    if "viewer" in recorder:
        state = recorder["viewer state"]
        is_shown = state == SHOWING
        words = f"watch it at {recorder['viewer']}" if is_shown else f"cannot be watched: {state}"
        console.print(words, soft_wrap=True)
    if view == WEB and not now:
        _wait_for_page(live)
    live.start()


def _wait_for_page(live: "LiveRun") -> None:
    """Wait until a browser shows the page, or until Enter.

    Raises:
        Interrupted: Ctrl-C was pressed; the empty recording is removed.
    """
    console.print("the run starts when the page is open, or with Enter   (Ctrl-C ends it)")
    try:
        while live.health("recorder").get("pages opened", "0") == "0" and not _enter_pressed():
            live.spin(GLANCE)
    except Interrupted:
        file = Path(live.health("recorder")["file"])
        live.stop()
        file.unlink(missing_ok=True)
        raise


def serve_page(live: "LiveRun") -> None:
    """Serve the page with the whole run until Ctrl-C."""
    console.print("the run is over; the page shows all of it until Ctrl-C", soft_wrap=True)
    try:
        while True:
            live.spin(1.0)
    except Interrupted:
        pass


def replay_hint(file: Path, view: str) -> str:
    """Return a hint that contains the command to show a recording again."""
    web = ["--web"] if view == WEB or not screens() else []
    return f"(look at it: {own_command()} {shlex.join(['view', str(file), *web])})"


def _enter_pressed() -> bool:
    """Return whether Enter was pressed; the end of standard input does not count."""
    try:
        descriptor = sys.stdin.fileno()
        # A background job that reads from its terminal would be stopped.
        if sys.stdin.isatty() and os.tcgetpgrp(descriptor) != os.getpgrp():
            return False
        return bool(select.select([descriptor], [], [], 0.0)[0] and os.read(descriptor, 4096))
    except (AttributeError, OSError, ValueError):  # no standard input, or closed
        return False


def follow_run(live: "LiveRun", scene: Scene, duration: float) -> None:
    """Show a run in the terminal until it has lasted for a duration, in simulated time [s].

    Raises:
        AbSimError: a node failed.
        Interrupted: the run was interrupted.
    """
    with _display(scene, duration) as show:
        while live.elapsed < duration:
            live.spin(0.1)
            show(live)


@contextlib.contextmanager
def _display(scene: Scene, duration: float) -> Iterator[Show]:
    """Show a bar with the drive's state; without a terminal, print a line per simulated second.

    Each new state of the profile controller is also printed, with its reason.
    """

    def state(live: "LiveRun") -> str:
        unit = scene.rotor.eccentricity
        whirl = f"W/e {live.whirl / unit:5.1f}" if unit else f"W {1e3 * live.whirl:6.3f} mm"
        balls = [f"{math.degrees(in_one_turn(angle)):7.1f}" for angle in live.ball_angles[:4]]
        more = [] if len(live.ball_angles) <= len(balls) else ["..."]
        heading = ["balls", *balls, *more, "deg"] if balls else []
        return " ".join([f"{live.speed:6.1f} rad/s  ", f"{whirl}  ", *heading])

    count = [0]

    def tell(live: "LiveRun") -> None:
        for at, status in live.statuses[count[0] :]:
            console.print(f"{at:5.1f} s   {status}", soft_wrap=True)
        count[0] = len(live.statuses)

    if not console.is_terminal:
        printed = [-1]

        def show_line(live: "LiveRun") -> None:
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

        def show(live: "LiveRun") -> None:
            tell(live)
            bar.update(task, completed=min(live.elapsed, duration), state=state(live))

        yield show
