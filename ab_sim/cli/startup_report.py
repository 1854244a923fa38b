"""What a live start-up came to: a table beside the offline run, and the three-part figure."""

import math
import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from ab_sim.analysis import peak_whirl, replay, run_scene, settling_period, time_of_speed
from ab_sim.errors import AbSimError
from ab_sim.plots import startup_figure
from ab_sim.recording import read_recording
from ab_sim.scene import Scene
from ab_sim.spindle import SpeedProfile
from ab_sim.trajectory import Trajectory

LOSSES = ("commands lost", "messages dropped by the recorder")
"""Figures of the live run that count, with missing samples, as messages lost."""

console = Console(markup=False)


def report_startup(scene: Scene, recording: Path, picture: Path, figures: dict[str, str]) -> None:
    """Sum a recorded start-up up beside an offline run of its scene, and draw it.

    Args:
        scene: what was run.
        recording: the .rrd file of it.
        picture: file to draw into.
        figures: label and value of what only the live run knows.
    """
    recorded = read_recording(recording)
    whole = Trajectory(recorded.channels, recorded.samples)
    live = _from_profile_start(whole, scene.duration)
    offline = run_scene(scene)
    profile, begins = SpeedProfile.of_scene(scene), offline.variable_speed_period
    assert begins is not None
    starts = time_of_speed(live, profile.speed(begins))

    table = Table("", "live", "offline", title="Start-up with a 0.5 s hold at the critical speed")
    for label, (one, other) in {
        "peak W/e": [_peak(t, scene) for t in (live, offline.trajectory)],
        "settling period": [
            _seconds(start, t) for start, t in ((starts, live), (begins, offline.trajectory))
        ],
        "final ball angles": [_degrees(t) for t in (live, offline.trajectory)],
    }.items():
        table.add_row(label, one, other)
    lost = recorded.missing + sum(int(figures.pop(label)) for label in LOSSES)
    for label, value in {**figures, "messages lost": str(lost)}.items():
        table.add_row(label, value, "")
    if recorded.missing == 0:
        worst = np.max(np.abs(replay(scene, whole).ball_angles - whole.ball_angles), initial=0.0)
        table.add_row("ball angles against a replay of the commands", f"{worst:.1e} rad", "")
    console.print(table)
    startup_figure(
        live, scene, picture, starts, title=f"Start-up of {scene.name}, live over ROS 2 topics"
    )
    viewer = Path(sys.executable).with_name("rerun")
    viewer = viewer.relative_to(Path.cwd()) if viewer.is_relative_to(Path.cwd()) else viewer
    console.print(f"wrote {recording}   (look at it: {viewer} {recording})")
    console.print(f"wrote {picture}")


def _from_profile_start(whole: Trajectory, duration: float) -> Trajectory:
    """The part in which the profile ran, with the time counted from its start."""
    moved = np.flatnonzero(whole["command"] != whole["command"][0])
    if len(moved) == 0:
        raise AbSimError("the recording holds no command: the profile controller was not heard")
    # A sample carries the command in force during the step that it ends.
    first = max(moved[0] - 1, 0)
    samples = whole.samples[first:].copy()
    samples[:, 1] -= samples[0, 1]
    return Trajectory(whole.channels, samples[samples[:, 1] <= duration])


def _peak(trajectory: Trajectory, scene: Scene) -> str:
    peak, at = peak_whirl(trajectory)
    return f"{peak / scene.rotor.eccentricity:.2f} at {at:.3f} s"


def _seconds(start: float | None, trajectory: Trajectory) -> str:
    settled = None if start is None else settling_period(trajectory, start)
    return "not settled" if settled is None else f"{settled:.3f} s"


def _degrees(trajectory: Trajectory) -> str:
    return ", ".join(f"{math.degrees(angle):.1f}" for angle in trajectory.ball_angles[-1]) + " deg"
