"""`ab-sim live`: a scene in real time, in one terminal, with an optional viewer."""

import contextlib
import math
import shutil
import tempfile
from pathlib import Path

from ab_sim.base.errors import InputError, Interrupted
from ab_sim.base.files import RECORDING, check_can_be_made, check_ending, check_writable
from ab_sim.cli.checks import require_ros
from ab_sim.cli.scene_commands import LiveOptions
from ab_sim.cli.watching import (
    NOWHERE,
    check_view_option,
    console,
    follow_run,
    recorder_parameters,
    replay_hint,
    serve_page,
    start_run,
)
from ab_sim.drive.overlap import together_at_start
from ab_sim.scene import load_scene
from ab_sim.show.viewing import WEB

RECORDINGS = Path("recordings")
"""Folder for recordings of runs with a viewer but without ``--record``."""


def run_live(options: LiveOptions) -> None:
    """Run a scene live until its duration is over or Ctrl-C.

    Raises:
        InputError: ROS 2 is missing, an argument is invalid, or another drive is running.
        AbSimError: a node failed; the message has its last output.
    """
    view, record = options.view, options.record
    check_view_option(view)
    scene = load_scene(options.scene, options.change)
    duration = scene.duration if options.seconds is None else options.seconds
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
    from ab_sim.cli.live_run import LiveRun

    logs = Path(tempfile.mkdtemp(prefix="ab_sim-log-"))
    recorder = recorder_parameters(record, view)
    console.print("starting the nodes ...")
    with LiveRun(scene, options.scene, options.change, recorder, logs) as live:
        live.wait_until_ready()
        start_run(live, view, options.now)
        whole = False
        with contextlib.suppress(Interrupted):
            follow_run(live, scene, duration)
            whole = True
        file = live.health("recorder").get("file", "")
        figures = live.stop_drive()
        console.print(", ".join(f"{label} {value}" for label, value in figures.items()))
        if file:
            console.print(f"wrote {file}   {replay_hint(Path(file), view)}", soft_wrap=True)
        if view == WEB and whole:
            serve_page(live)
        live.stop()
    shutil.rmtree(logs)  # kept for a run that failed
