"""`ab-sim demo`: the thesis' start-up, live over ROS 2, recorded, summed up and drawn."""

import contextlib
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn
from rich.table import Table

from ab_sim.analysis import peak_whirl, replay, run_scene, settling_period, time_of_speed
from ab_sim.cli.offline import check_writable
from ab_sim.errors import AbSimError, InputError
from ab_sim.recording import read_recording
from ab_sim.scene import Scene, load_scene
from ab_sim.spindle import SpeedProfile
from ab_sim.trajectory import Trajectory

SCENE = "thesis-hold"
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

    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"--out {out}: cannot be made: {error.strerror}") from error
    recording, picture = out / "startup.rrd", out / "startup.png"
    for file in (recording, picture):
        check_writable(file)

    scene = load_scene(SCENE)
    console.print(f"Start-up of [bold]{scene.name}[/] in real time: {scene.description}")
    with LiveRun(scene, recording, out / "log") as live:
        console.print("three nodes are up: drive_sim, profile_controller, recorder")
        live.start()
        with _progress(scene) as show:
            while live.elapsed < scene.duration:
                live.spin(0.1)
                show(live)
        figures = live.stop()
    _report(scene, recording, picture, figures)


@contextlib.contextmanager
def _progress(scene: Scene) -> Iterator[Any]:
    def state(live: Any) -> str:
        text = f"{live.speed:6.1f} rad/s   W/e {live.whirl / scene.rotor.eccentricity:5.1f}   balls "
        return text + " ".join(f"{math.degrees(a):7.1f}" for a in live.ball_angles) + " deg"

    if not console.is_terminal:
        printed = [-1]

        def show_line(live: Any) -> None:
            if int(live.elapsed) > printed[0]:
                printed[0] = int(live.elapsed)
                console.print(f"{live.elapsed:5.1f} of {scene.duration:g} s   {state(live)}")

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


def _report(scene: Scene, recording: Path, picture: Path, figures: dict[str, str]) -> None:
    from ab_sim.plots import startup_figure

    recorded = read_recording(recording)
    live = Trajectory(tuple(recorded.channels), recorded.samples)
    again = replay(scene, live) if recorded.missing == 0 else None
    begin = _profile_start(live)
    shifted = live.samples.copy()
    shifted[:, 1] -= begin
    live = Trajectory(live.channels, shifted)
    offline = run_scene(scene)
    profile = SpeedProfile.of_scene(scene)
    assert profile.variable_speed_period is not None
    starts = time_of_speed(live, profile.speed(profile.variable_speed_period))

    table = Table("", "live", "offline", title="Start-up with a 0.5 s hold at the critical speed")
    e = scene.rotor.eccentricity
    for label, values in (
        ("peak W/e", [f"{peak_whirl(t)[0] / e:.2f}" for t in (live, offline.trajectory)]),
        ("its time [s]", [f"{peak_whirl(t)[1]:.3f}" for t in (live, offline.trajectory)]),
        (
            "settling period [s]",
            [
                _seconds(None if starts is None else settling_period(live, starts)),
                _seconds(settling_period(offline.trajectory, profile.variable_speed_period)),
            ],
        ),
        ("final ball angles [deg]", [_degrees(t) for t in (live, offline.trajectory)]),
    ):
        table.add_row(label, *values)
    lost = recorded.missing + int(figures.pop("messages dropped by the recorder"))
    for label, value in {**figures, "messages lost": str(lost)}.items():
        table.add_row(label, value, "")
    if again is not None:
        worst = np.max(np.abs(again.ball_angles - live.ball_angles), initial=0.0)
        table.add_row("ball angles against a replay of the commands", f"{worst:.1e} rad", "")
    console.print(table)
    startup_figure(
        live, scene, picture, starts, title=f"Start-up of {scene.name}, live over ROS 2 topics"
    )
    console.print(f"wrote {recording}   (look at it: rerun {recording})")
    console.print(f"wrote {picture}")


def _profile_start(live: Trajectory) -> float:
    moved = np.flatnonzero(live["command"] != live["command"][0])
    if len(moved) == 0:
        raise AbSimError("the recording holds no command: the profile controller was not heard")
    # A sample carries the command in force during the step that it ends.
    return float(live["time"][max(moved[0] - 1, 0)])


def _seconds(value: float | None) -> str:
    return "not settled" if value is None else f"{value:.3f}"


def _degrees(trajectory: Trajectory) -> str:
    return ", ".join(f"{math.degrees(angle):.1f}" for angle in trajectory.ball_angles[-1])
