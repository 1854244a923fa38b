"""A report of a decimated recording says what one of the whole run does, as far as it can."""

from pathlib import Path

import pytest

from ab_sim.drive import Drive
from ab_sim.drive.description import describe
from ab_sim.drive.trajectory import Trajectory
from ab_sim.record.recording import Recording, open_recording
from ab_sim.scene import load_scene
from ab_sim.show.gather import RunData, gather


def reported(path: Path, run: Trajectory, description: dict, every: int) -> RunData:
    with Recording(path, description=description, every=every, around=0.1) as recording:
        recording.block(run.channels, run.samples)
    return gather(open_recording(path), path.name)


def test_its_metrics_are_those_of_the_run(tmp_path: Path) -> None:
    scene = load_scene("balanced-start-up")
    drive = Drive(scene)
    run = Trajectory.join([drive.present(), drive.advance(9000)])
    whole = reported(tmp_path / "whole.rrd", run, describe(scene), 1)
    decimated = reported(tmp_path / "decimated.rrd", run, describe(scene), 20)
    one, other = whole.metrics, decimated.metrics
    assert one is not None and other is not None
    assert other.final_whirl == pytest.approx(one.final_whirl, rel=0.02)
    assert other.residual_unbalance == pytest.approx(one.residual_unbalance, rel=0.02)
    assert other.peak_whirl == pytest.approx(one.peak_whirl, rel=0.02)
    assert other.in_band_from == pytest.approx(one.in_band_from, abs=0.1)
    assert decimated.vibration.rms == pytest.approx(whole.vibration.rms, rel=0.05)
    assert decimated.vibration.share == pytest.approx(whole.vibration.share, abs=0.02)
    assert any("left out by intent" in note for note in decimated.notes) and not whole.notes
