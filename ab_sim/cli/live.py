"""`ab-sim live`: a scene in real time, in one terminal, and in a viewer if wanted."""

import contextlib
import math
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

from ab_sim.cli.outputs import PlainConsole
from ab_sim.cli.own_command import own_command
from ab_sim.cli.ros import require_ros
from ab_sim.drive.overlap import together_at_start
from ab_sim.errors import InputError, Interrupted
from ab_sim.output_file import RECORDING, check_ending, check_writable
from ab_sim.scene import load_scene
from ab_sim.viewing import check_view

NOWHERE = "none"
"""To ``--view``: nobody watches."""
console = PlainConsole()


def check_wish(view: str) -> None:
    """Refuse a ``--view`` that nothing can be shown in.

    Raises:
        InputError: says what is allowed.
    """
    if view == NOWHERE:
        return
    try:
        check_view(view, screen=True)
    except InputError as error:
        raise InputError(f"--view {error}; or {NOWHERE}") from error


def run_live(
    source: str,
    changes: Sequence[str],
    view: str,
    record: Path | None,
    seconds: float | None,
) -> None:
    """Run a scene live until its duration is over or Ctrl-C asks for the end.

    Args:
        source: name of a scene, or its file.
        changes: to the scene, each ``key=value``.
        view: ``none``, ``web``, ``native`` or the address of a viewer that runs.
        record: .rrd file to keep; one that is there is not overwritten, another is made beside it.
        seconds: of simulated time, instead of the scene's duration.

    Raises:
        InputError: ROS 2 is missing, an argument is wrong, another drive is running.
        AbSimError: a node failed; its last words are given.
    """
    check_wish(view)
    scene = load_scene(source, changes)
    duration = scene.duration if seconds is None else seconds
    if not (math.isfinite(duration) and duration > 0.0):
        raise InputError(f"--for {duration:g}: must be above 0 s")
    if record is not None:
        check_ending(record, RECORDING, "--record")
        check_writable(record, "--record", replaced=False)
    if together := together_at_start(scene):
        console.print(together, soft_wrap=True)
    require_ros("for a live run")
    from ab_sim.cli.live_display import live_display
    from ab_sim.cli.live_run import LiveRun

    logs = Path(tempfile.mkdtemp(prefix="ab_sim-log-"))
    with LiveRun(scene, source, changes, recorder_parameters(record, view), logs) as live:
        live.wait_until_ready()
        say_where(live.health("recorder"))
        live.start()
        with (
            contextlib.suppress(Interrupted),
            live_display(console, scene, duration) as show,
        ):
            while live.elapsed < duration:
                live.spin(0.1)
                show(live)
        file = live.health("recorder").get("file", "")
        figures = live.stop()
    shutil.rmtree(logs)  # of a run that failed they are what there is to read
    console.print(", ".join(f"{label} {value}" for label, value in figures.items()))
    if record is not None:
        console.print(f"wrote {file}   (look at it: {own_command()} view {file})", soft_wrap=True)


def recorder_parameters(record: Path | None, view: str) -> dict[str, str] | None:
    """What the recorder is to be told; None: none is needed."""
    if record is None and view == NOWHERE:
        return None
    return (
        {"keep": "false", "view": view} if record is None else {"path": str(record), "view": view}
    )


def say_where(recorder: dict[str, str]) -> None:
    """Say where to watch, or why that is not possible."""
    if "viewer" in recorder:
        state = recorder["viewer state"]
        what = "watch it at" if state == "showing" else f"cannot be watched, {state}:"
        console.print(f"{what} {recorder['viewer']}", soft_wrap=True)
