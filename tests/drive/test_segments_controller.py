"""A drive whose segments end on conditions, led offline by what leads them live."""

from typing import Any

import numpy as np
import pytest

from ab_sim.analysis import run_scene
from ab_sim.drive import Drive
from ab_sim.drive.faults.fault import faults_of
from ab_sim.drive.snapshot_file import read_snapshot, write_snapshot
from ab_sim.scene import Scene
from tests.conftest import SceneMaker

CALM = {"vibration_rms_below": 12.0, "over": 0.2, "at_most": 3.0}
STEPS = 6000


def segments(**until: Any) -> dict[str, Any]:
    """Above the critical speed, hold until it is calm; then on."""
    return {
        "kind": "segments",
        "segments": [
            {"to": 110.0, "acceleration": 90.0},
            {"until": {**CALM, **until}},
            {"to": 150.0, "acceleration": 50.0},
        ],
    }


@pytest.fixture
def waiting(scene: SceneMaker) -> Scene:
    return scene(profile=segments(), sensors={"pickup": {"bandwidth": 300.0}}, duration=6.0)


def test_a_hold_ends_when_it_is_calm(waiting: Scene) -> None:
    run = run_scene(waiting)
    texts = [decided.text for decided in run.decisions]
    assert [text.partition(",")[0] for text in texts[:3]] == [
        f"running: segment {number} of 3" for number in (1, 2, 3)
    ]
    assert texts[3] == "done"
    began, ended = run.decisions[1].time, run.decisions[2].time
    assert began == pytest.approx(110 / 90, abs=0.01) and 0.4 < ended - began < 2.9
    time, speed = run.trajectory["time"], run.trajectory["speed"]
    held = (time > began + 0.02) & (time <= ended)
    assert np.all(speed[held] == 110.0) and speed[-1] == 150.0
    # By what was measured, and not by chance: it is calm then, and was not before.
    read = np.hypot(run.trajectory["pickup_1"], run.trajectory["pickup_2"])
    windows = [np.sqrt(np.mean(read[(time > t - 0.2) & (time <= t)] ** 2)) for t in (began, ended)]
    assert windows[0] > 12.0 > windows[1] > 9.0


def test_what_is_not_met_lasts_as_long_as_it_may_or_aborts(scene: SceneMaker) -> None:
    def led(**until: Any) -> Any:
        return run_scene(scene(profile=segments(vibration_rms_below=1e-3, **until), duration=6.0))

    goes_on, aborts = led(), led(otherwise="abort")
    # Commands come each 5 ms, and the spindle is where the profile is when the next one comes.
    planned = Drive(goes_on.scene.planned).advance(STEPS)
    assert np.abs(goes_on.trajectory["speed"][1:] - planned["speed"])[4::5].max() < 1e-9
    assert "no vibration below 0.001 m/s^2 within 3 s" in goes_on.decisions[2].text
    assert aborts.decisions[2].text.startswith("aborting: segment 2")
    assert goes_on.aborted is None and aborts.aborted is not None
    assert aborts.decisions[2] == (aborts.aborted.time, f"aborting: {aborts.aborted.text}")
    assert aborts.decisions[3].text == "aborted" and aborts.trajectory["speed"][-1] == 0.0


def test_pieces_do_not_matter_and_a_snapshot_goes_on(waiting: Scene, tmp_path: Any) -> None:
    whole, drive, taken = Drive(waiting).advance(STEPS), Drive(waiting), []
    for piece in (1, 998, 7, 500, 1111):
        taken.append(drive.advance(piece).samples)
    write_snapshot(tmp_path / "kept.json", waiting, kept := drive.snapshot(), {})
    left = STEPS - drive.steps
    taken.append(drive.advance(left).samples)
    assert np.vstack(taken).tobytes() == whole.samples.tobytes()
    for snapshot in (kept, read_snapshot(tmp_path / "kept.json", waiting)[0]):
        drive.restore(snapshot)
        assert drive.advance(left).samples.tobytes() == taken[-1].tobytes()
    with pytest.raises(ValueError, match="state of a profile"):
        drive.restore(kept._replace(controller={"state": "running"}))


def test_a_sensor_that_is_not_heard_aborts(waiting: Scene) -> None:
    drive = Drive(waiting, faults=faults_of(["pickup drops"]))
    drive.advance(STEPS)
    assert drive.controller is not None and drive.observe().omega == 0.0
    texts = [decided.text for decided in drive.controller.decisions]
    assert any("no valid sample of it has come for 1" in text for text in texts)
