"""`ab-sim demo`: a start-up that gets balanced, live over ROS 2, recorded, judged and drawn."""

import contextlib
import importlib
import math
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from ab_sim.errors import InputError
from ab_sim.output_file import check_writable
from ab_sim.scene import Scene, load_scene

SCENE = "balanced-start-up"
REPORT = "ab_sim.cli.startup_report"
console = Console()


def run_demo(out: Path) -> None:
    """Run it; write ``startup.rrd`` and ``startup.png`` into ``out``.

    Raises:
        InputError: ROS 2 is missing, the folder cannot be written, another drive is running.
        AbSimError: a node failed; its log is named.
    """
    try:
        import rclpy  # noqa: F401
    except ImportError as error:
        raise InputError(
            f"ROS 2 is needed for the demo, and rclpy cannot be imported ({error}); "
            "install it with `pip install 'ab_sim[ros]'`, or source your ROS 2 installation"
        ) from error
    from ab_sim.cli.live import LiveRun

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
    console.print(f"Start-up of [bold]{scene.name}[/] in real time: {scene.description}")
    with LiveRun(scene, recording, logs) as live:
        live.wait_until_ready()
        console.print("three nodes are up: drive_sim, profile_controller, recorder")
        live.start()
        # Slow to import, and there is nothing to do but watch.
        reporting = threading.Thread(target=importlib.import_module, args=[REPORT], daemon=True)
        reporting.start()
        with _progress(scene) as show:
            while live.elapsed < scene.duration:
                live.spin(0.1)
                show(live)
        figures = live.stop()
    reporting.join()
    importlib.import_module(REPORT).report_startup(scene, recording, picture, figures)


@contextlib.contextmanager
def _progress(scene: Scene) -> Iterator[Any]:
    def state(live: Any) -> str:
        text = (
            f"{live.speed:6.1f} rad/s   W/e {live.whirl / scene.rotor.eccentricity:5.1f}   balls "
        )
        return text + " ".join(f"{math.degrees(a):7.1f}" for a in live.ball_angles) + " deg"

    if not console.is_terminal:
        printed = [-1]

        def show_line(live: Any) -> None:
            if int(live.elapsed) > printed[0]:
                printed[0] = int(live.elapsed)
                done = min(live.elapsed, scene.duration)
                console.print(f"{done:5.1f} of {scene.duration:g} s   {state(live)}")

        yield show_line
        return
    columns = (
        BarColumn(),
        TextColumn("{task.completed:5.2f} of {task.total:g} s"),
        TextColumn("{task.fields[state]}"),
    )
    with Progress(*columns, console=console) as bar:
        task = bar.add_task("", total=scene.duration, state="")

        def show(live: Any) -> None:
            bar.update(task, completed=min(live.elapsed, scene.duration), state=state(live))

        yield show
