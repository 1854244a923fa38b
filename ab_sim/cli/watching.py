"""Messages and waits of `ab-sim live` and `ab-sim demo` with a viewer."""

import os
import select
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from ab_sim.cli.outputs import PlainConsole
from ab_sim.cli.own_command import own_command
from ab_sim.errors import InputError, Interrupted
from ab_sim.viewing import SHOWING, WEB, check_view, screens

if TYPE_CHECKING:
    from ab_sim.cli.live_run import LiveRun

NOWHERE = "none"
"""Value of ``--view`` without a viewer."""
GLANCE = 0.1
"""Time between two checks for a page or for Enter [s]."""


def check_wish(view: str) -> None:
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


def say_where(console: PlainConsole, live: "LiveRun") -> None:
    """Print the address of the viewer, or why there is none."""
    recorder = live.health("recorder")
    if "viewer" in recorder:
        state = recorder["viewer state"]
        what = "watch it at" if state == SHOWING else f"cannot be watched, {state}:"
        console.print(f"{what} {recorder['viewer']}", soft_wrap=True)


def wait_for_page(console: PlainConsole, live: "LiveRun") -> None:
    """Wait until a browser shows the page, or until Enter.

    Raises:
        Interrupted: interrupted; the empty recording is removed.
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


def serve_page(console: PlainConsole, live: "LiveRun") -> None:
    """Keep serving the page, with the whole run, until Ctrl-C."""
    console.print("the run is over; the page shows all of it until Ctrl-C", soft_wrap=True)
    try:
        while True:
            live.spin(1.0)
    except Interrupted:
        pass


def replay_hint(file: Path, view: str) -> str:
    """Return a hint with a command that shows a recording again."""
    web = ["--web"] if view == WEB or not screens() else []
    return f"(look at it: {own_command()} {shlex.join(['view', str(file), *web])})"


def _enter_pressed() -> bool:
    """Return whether a line came from standard input; its end does not count."""
    try:
        descriptor = sys.stdin.fileno()
        # A background job that reads from its terminal would be stopped.
        if sys.stdin.isatty() and os.tcgetpgrp(descriptor) != os.getpgrp():
            return False
        return bool(select.select([descriptor], [], [], 0.0)[0] and os.read(descriptor, 4096))
    except (AttributeError, OSError, ValueError):  # no standard input, or closed
        return False
