"""`ab-sim live`: a scene in real time, in one terminal, with an optional viewer."""

import contextlib
import math
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

from ab_sim.cli.outputs import PlainConsole
from ab_sim.cli.ros import require_ros
from ab_sim.cli.watching import (
    NOWHERE,
    check_wish,
    replay_hint,
    say_where,
    serve_page,
    wait_for_page,
)
from ab_sim.drive.overlap import together_at_start
from ab_sim.errors import InputError, Interrupted
from ab_sim.output_file import RECORDING, check_can_be_made, check_ending, check_writable
from ab_sim.scene import load_scene
from ab_sim.viewing import WEB

RECORDINGS = Path("recordings")
"""Folder for recordings of runs with a viewer but without ``--record``."""
console = PlainConsole()


def run_live(
    source: str,
    changes: Sequence[str],
    view: str,
    record: Path | None,
    seconds: float | None,
    now: bool,
) -> None:
    """Run a scene live until its duration is over or Ctrl-C.

    Args:
        source: name or file of a scene.
        changes: changes to the scene, each ``key=value``.
        view: ``none``, ``web``, ``native`` or the address of a running viewer.
        record: .rrd file to keep; if it exists, a new one with a number is written. None: a file in
            `RECORDINGS` with a viewer, else none.
        seconds: simulated time [s], instead of the scene's duration.
        now: start at once, without waiting for a page that shows the run.

    Raises:
        InputError: ROS 2 is missing, an argument is wrong, another drive is running.
        AbSimError: a node failed; the message has its last output.
    """
    check_wish(view)
    scene = load_scene(source, changes)
    duration = scene.duration if seconds is None else seconds
    if not (math.isfinite(duration) and duration > 0.0):
        raise InputError(f"--for {duration:g}: must be above 0 s")
    if record is not None:
        check_ending(record, RECORDING, "--record")
        check_writable(record, "--record", replaced=False)
    elif view != NOWHERE:
        check_can_be_made(RECORDINGS, "without --record, the folder")
    if together := together_at_start(scene):
        console.print(together, soft_wrap=True)
    require_ros("for a live run")
    from ab_sim.cli.live_display import live_display
    from ab_sim.cli.live_run import LiveRun

    logs = Path(tempfile.mkdtemp(prefix="ab_sim-log-"))
    with LiveRun(scene, source, changes, recorder_parameters(record, view), logs) as live:
        live.wait_until_ready()
        say_where(console, live)
        if view == WEB and not now:
            wait_for_page(console, live)
        live.start()
        whole = False
        with (
            contextlib.suppress(Interrupted),
            live_display(console, scene, duration) as show,
        ):
            while live.elapsed < duration:
                live.spin(0.1)
                show(live)
            whole = True
        file = live.health("recorder").get("file", "")
        figures = live.stop_drive()
        console.print(", ".join(f"{label} {value}" for label, value in figures.items()))
        if file:
            console.print(f"wrote {file}   {replay_hint(Path(file), view)}", soft_wrap=True)
        if view == WEB and whole:
            serve_page(console, live)
        live.stop()
    shutil.rmtree(logs)  # kept for a run that failed


def recorder_parameters(record: Path | None, view: str) -> dict[str, str] | None:
    """Return the recorder's parameters; None: no recorder is needed."""
    if record is None and view == NOWHERE:
        return None
    return {"view": view} if record is None else {"path": str(record), "view": view}
