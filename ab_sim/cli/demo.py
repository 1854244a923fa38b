"""`ab-sim demo`: a start-up that balances, live over ROS 2, recorded, judged and drawn."""

import importlib
import os
import threading

from rich.text import Text

from ab_sim.base.errors import InputError
from ab_sim.base.files import check_writable
from ab_sim.cli.checks import require_ros
from ab_sim.cli.scene_commands import DemoOptions
from ab_sim.cli.watching import (
    check_view_option,
    console,
    follow_run,
    recorder_parameters,
    replay_hint,
    serve_page,
    start_run,
)
from ab_sim.scene import load_scene
from ab_sim.show.viewing import WEB

SCENE = "balanced-start-up"
REPORT = "ab_sim.cli.startup_report"


def run_demo(options: DemoOptions) -> None:
    """Run the demo, and write ``startup.rrd`` and ``startup.png`` into ``--out``.

    Raises:
        InputError: ROS 2 is missing, the folder cannot be written, or another drive is running.
        AbSimError: a node failed; the message names its log.
    """
    out, view = options.out, options.view
    check_view_option(view)
    require_ros("for a live run")
    from ab_sim.cli.live_run import LiveRun

    logs = out / "log"
    try:
        logs.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"--out {out}: {logs} cannot be made: {error.strerror}") from error
    recording, picture = out / "startup.rrd", out / "startup.png"
    for file in (recording, picture):
        check_writable(file, "--out")
        file.unlink(missing_ok=True)

    scene = load_scene(SCENE)
    name = Text(scene.name, "bold")
    console.print(Text.assemble("Start-up of ", name, f" in real time: {scene.description}"))
    console.print("starting three nodes ...")
    with LiveRun(scene, SCENE, (), recorder_parameters(recording, view), logs) as live:
        live.wait_until_ready()
        console.print("three nodes are up: drive_sim, profile_controller, recorder")
        start_run(live, view, options.now)
        # This import is slow; it happens while the run is in progress.
        reporting = threading.Thread(target=_import_report, daemon=True)
        reporting.start()
        follow_run(live, scene, scene.duration)
        figures = live.stop_drive()
        if view != WEB:
            live.stop()
        reporting.join()
        hint = replay_hint(recording, view)
        console.print("comparing with an offline run, and with a run without balls ...")
        importlib.import_module(REPORT).report_startup(scene, recording, picture, figures, hint)
        if view == WEB:
            serve_page(live)
            live.stop()


def _import_report() -> None:
    os.nice(10)  # affects only this thread on Linux: the nodes have priority
    importlib.import_module(REPORT)
