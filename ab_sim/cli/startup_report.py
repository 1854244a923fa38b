"""Report on a live start-up: a table with offline runs, and the figure."""

from pathlib import Path

import numpy as np
from rich.table import Table

from ab_sim.analysis import compare_run, metrics_of, run_scene, time_of_speed
from ab_sim.base.errors import AbSimError
from ab_sim.base.sample_columns import TIME
from ab_sim.cli.outputs import results
from ab_sim.cli.run import metrics_table
from ab_sim.cli.runner import FINE
from ab_sim.drive.trajectory import Trajectory
from ab_sim.model.spindle import SpeedSchedule
from ab_sim.record.recording import open_recording
from ab_sim.scene import Scene
from ab_sim.show.run import drawn_run
from ab_sim.show.saved import save

_LOSSES = ("commands lost", "messages dropped by the recorder")
"""Figures of the live run that count as lost messages, together with missing samples."""


def report_startup(
    scene: Scene, recording: Path, picture: Path, figures: dict[str, str], hint: str
) -> None:
    """Compare a recorded start-up with an offline run of its scene, and draw it.

    Parameters
    ----------
    scene
        Scene of the run.
    recording
        The .rrd file of the start-up.
    picture
        File for the figure.
    figures
        Labels and values that only the live run has.
    hint
        Text on how to view the recording again.
    """
    recorded = open_recording(recording)
    live = _from_profile_start(recorded.trajectory(), scene.duration)
    offline = run_scene(scene)
    comparison = compare_run(offline)
    profile, begins = SpeedSchedule.of_scene(scene), offline.variable_speed_period
    assert begins is not None
    starts = time_of_speed(live, profile.speed(begins))

    runs = {"live": metrics_of(live, scene), "offline": offline.metrics}
    results.print(metrics_table(f"Start-up of {scene.name}", scene, runs, comparison))
    table = Table(show_header=False, title="The live run")
    lost = recorded.extent.missing + sum(int(figures.pop(label)) for label in _LOSSES)
    for label, value in {**figures, "messages lost": str(lost)}.items():
        table.add_row(label, value)
    table.add_row("samples against the offline run", _difference(live, offline.trajectory))
    results.print(table)
    title = f"Start-up of {scene.name}, live over ROS 2 topics"
    save(drawn_run(live, scene, comparison, starts, title), picture, FINE)
    results.print(f"wrote {recording}   {hint}", soft_wrap=True)
    results.print(f"wrote {picture}")


def _difference(live: Trajectory, offline: Trajectory) -> str:
    """Return the difference between two runs at their common steps, as text.

    The first sample is omitted: a live drive takes it before its first command.
    """
    _, ours, theirs = np.intersect1d(live["step"][1:], offline["step"][1:], return_indices=True)
    ours, theirs = ours + 1, theirs + 1
    if np.array_equal(live.samples[ours], offline.samples[theirs]):
        return "identical to the last bit"
    worst = np.max(np.abs(live.ball_angles[ours] - offline.ball_angles[theirs]), initial=0.0)
    return f"ball angles differ by up to {worst:.1e} rad"


def _from_profile_start(whole: Trajectory, duration: float) -> Trajectory:
    """Return the part of a run from the profile's start on, with times counted from there."""
    moved = np.flatnonzero(whole["command"] != whole["command"][0])
    if len(moved) == 0:
        raise AbSimError("the recording has no command: none of the profile controller arrived")
    # A sample contains the command of the step that ends at this sample.
    first = max(moved[0] - 1, 0)
    samples = whole.samples[first:].copy()
    samples[:, TIME] -= samples[0, TIME]
    return Trajectory(whole.channels, samples[samples[:, TIME] <= duration])
