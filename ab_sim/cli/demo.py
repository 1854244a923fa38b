"""`ab-sim demo`: a start-up that gets balanced, live over ROS 2, recorded, judged and drawn."""

import importlib
import os
import threading
from pathlib import Path

from rich.text import Text

from ab_sim.cli.live import check_wish, recorder_parameters, say_where
from ab_sim.cli.outputs import PlainConsole
from ab_sim.cli.ros import require_ros
from ab_sim.errors import InputError
from ab_sim.output_file import check_writable
from ab_sim.scene import load_scene

SCENE = "balanced-start-up"
REPORT = "ab_sim.cli.startup_report"
console = PlainConsole()


def run_demo(out: Path, view: str) -> None:
    """Run it; write ``startup.rrd`` and ``startup.png`` into ``out``.

    Args:
        out: folder, made if it is not there.
        view: where to watch it: ``none``, ``web``, ``native`` or the address of a viewer.

    Raises:
        InputError: ROS 2 is missing, the folder cannot be written, another drive is running.
        AbSimError: a node failed; its log is named.
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
        say_where(live.health("recorder"))
        live.start()
        # Slow to import, and there is nothing to do but watch.
        reporting = threading.Thread(target=_import_report, daemon=True)
        reporting.start()
        with live_display(console, scene, scene.duration) as show:
            while live.elapsed < scene.duration:
                live.spin(0.1)
                show(live)
        figures = live.stop()
    reporting.join()
    importlib.import_module(REPORT).report_startup(scene, recording, picture, figures)


def _import_report() -> None:
    os.nice(10)  # of this thread alone, on Linux: the nodes come first
    importlib.import_module(REPORT)
