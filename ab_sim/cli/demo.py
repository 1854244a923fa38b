"""`ab-sim demo`: a start-up that balances, live over ROS 2, recorded, judged and drawn."""

import importlib
import os
import threading
from pathlib import Path

from rich.text import Text

from ab_sim.cli.live import recorder_parameters
from ab_sim.cli.outputs import PlainConsole
from ab_sim.cli.ros import require_ros
from ab_sim.cli.watching import (
    check_wish,
    replay_hint,
    say_where,
    serve_page,
    wait_for_page,
)
from ab_sim.errors import InputError
from ab_sim.output_file import check_writable
from ab_sim.scene import load_scene
from ab_sim.viewing import WEB

SCENE = "balanced-start-up"
REPORT = "ab_sim.cli.startup_report"
console = PlainConsole()


def run_demo(out: Path, view: str, now: bool) -> None:
    """Run the demo, and write ``startup.rrd`` and ``startup.png`` into ``out``.

    Args:
        out: folder, created if missing.
        view: viewer: ``none``, ``web``, ``native`` or the address of a viewer.
        now: start at once, without waiting for a page that shows the run.

    Raises:
        InputError: ROS 2 is missing, the folder cannot be written, or another drive is running.
        AbSimError: a node failed; the message names its log.
    """
    check_wish(view)
    require_ros("for a live run")
    from ab_sim.cli.live_display import live_display
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
    with LiveRun(scene, SCENE, (), recorder_parameters(recording, view), logs) as live:
        live.wait_until_ready()
        console.print("three nodes are up: drive_sim, profile_controller, recorder")
        say_where(console, live)
        if view == WEB and not now:
            wait_for_page(console, live)
        live.start()
        # This import is slow; it happens while the run is in progress.
        reporting = threading.Thread(target=_import_report, daemon=True)
        reporting.start()
        with live_display(console, scene, scene.duration) as show:
            while live.elapsed < scene.duration:
                live.spin(0.1)
                show(live)
        figures = live.stop_drive()
        if view != WEB:
            live.stop()
        reporting.join()
        hint = replay_hint(recording, view)
        importlib.import_module(REPORT).report_startup(scene, recording, picture, figures, hint)
        if view == WEB:
            serve_page(console, live)
            live.stop()


def _import_report() -> None:
    os.nice(10)  # affects only this thread on Linux: the nodes have priority
    importlib.import_module(REPORT)
