"""What befalls viewer, disk, drive, wire and recorder: it is said, counted, and recovered from."""

import os
import re
import resource
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from ab_sim.base.errors import RecordingError
from tests.recorded import read_recording
from tests.recording.runs import describe, run, still

if TYPE_CHECKING:
    from subprocess import Popen

    from tests.nodes.fleet import Fleet

pytestmark = [pytest.mark.ros, pytest.mark.long]


def number(fleet: "Fleet", key: str) -> int:
    return int(fleet.value("recorder", key) or 0)


def wait_for_samples(fleet: "Fleet", more: int = 100) -> None:
    goal = number(fleet, "samples written") + more
    fleet.until(lambda: number(fleet, "samples written") >= goal, f"{more} more samples")


def start(fleet: "Fleet", **parameters: object) -> "Popen[bytes]":
    """A recorder, and a drive that begins when it is heard; the recorder's process.

    It drops no steps for a busy machine, which may keep it from running for its own 0.5 s.
    """
    recorder = fleet.start("recorder", **parameters)
    fleet.start("drive_sim", scene="thesis-hold", start_paused=True, patience=5.0)
    fleet.until(lambda: fleet.value("recorder", "file"), "the recorder has a drive")
    assert fleet.call("drive_sim/pause", False)[0]
    return recorder


# --- the viewer -----------------------------------------------------------------------------


def test_viewer_stopped_killed_and_shown_again(fleet: "Fleet", tmp_path: Path) -> None:
    file = tmp_path / "run.rrd"

    def viewer() -> str:
        return fleet.value("recorder", "viewer state")

    start(fleet, path=file, view="web")
    fleet.until(lambda: viewer() == "showing", "a viewer")
    fleet.reads("recorder", fleet.value("recorder", "viewer"))
    first = number(fleet, "viewer process")
    os.kill(first, signal.SIGSTOP)
    fleet.until(lambda: viewer().startswith("does not answer"), "that is noticed")
    assert "viewer does not answer" in fleet.health("recorder").message
    wait_for_samples(fleet)
    os.kill(first, signal.SIGKILL)
    fleet.until(lambda: number(fleet, "viewer restarts") == 1, "it is started again")
    fleet.until(lambda: viewer() == "showing", "and shows again")
    wait_for_samples(fleet)
    second = number(fleet, "viewer process")
    assert fleet.stop("drive_sim") == 0 and fleet.stop("recorder") == 0
    assert not Path(f"/proc/{second}").exists()
    assert fleet.value("drive_sim", "steps dropped") == "0"
    recorded = read_recording(file)
    assert recorded.complete and recorded.missing == 0 and recorded.samples[0, 0] == 0


def test_no_screen_no_viewer_there_and_no_file_kept(
    no_screen: None, fleet: "Fleet", tmp_path: Path
) -> None:
    fleet.start("drive_sim", scene="thesis-hold")
    for view, words in (
        ("native", "could not start: there is no screen"),
        ("rerun+http://127.0.0.1:9/proxy", "there is no viewer at rerun+http://127.0.0.1:9/proxy"),
    ):
        fleet.healths.clear()
        file = tmp_path / f"{len(view)}.rrd"
        fleet.start("recorder", path=file, view=view)
        fleet.until(lambda want=words: want in fleet.value("recorder", "viewer state"), words)
        wait_for_samples(fleet)
        assert fleet.health("recorder").level.name == "WARN"
        assert fleet.stop("recorder") == 0
        assert read_recording(file).complete
    fleet.healths.clear()
    fleet.start("recorder", view="web", keep=False)
    wait_for_samples(fleet)
    file = Path(fleet.value("recorder", "file"))
    assert file.exists()
    assert fleet.stop("recorder") == 0
    assert not file.parent.exists()


def about(file: Path) -> str:
    """Return the newest text next to the drawings."""
    return str(still(file, "/about", "TextDocument:text")[-1])


def test_final_values_are_shown_when_the_drive_has_ended(fleet: "Fleet", tmp_path: Path) -> None:
    """While the recorder and its page go on."""
    recorder = start(fleet, path=tmp_path / "run.rrd", view="web")
    wait_for_samples(fleet)
    opened = [file.resolve() for file in Path(f"/proc/{recorder.pid}/fd").iterdir()]
    [shown] = {file for file in opened if file.parent.name.startswith("ab_sim-live-")}
    assert "At the end" not in about(shown)
    assert fleet.stop("drive_sim") == 0
    fleet.until(lambda: "**At the end**: W/e = " in about(shown), "the page has the final whirl")
    assert fleet.stop("recorder") == 0


# --- the disk -------------------------------------------------------------------------------


def test_disk_full_and_room_again(fleet: "Fleet", tmp_path: Path) -> None:
    """A real write error: the kernel lets its files grow no further, and later again."""
    file = tmp_path / "run.rrd"
    process = start(fleet, path=file)
    wait_for_samples(fleet)
    unlimited = resource.prlimit(process.pid, resource.RLIMIT_FSIZE)
    resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (1000, unlimited[1]))
    fleet.until(lambda: fleet.health("recorder").level.name == "ERROR", "it is said")
    assert "File too large" in fleet.health("recorder").message
    fleet.until(lambda: number(fleet, "samples lost") > 0, "and counted")
    assert os.listdir(tmp_path).count("run-2.rrd") == 0, "what holds nothing is not left"
    resource.prlimit(process.pid, resource.RLIMIT_FSIZE, unlimited)
    fleet.until(lambda: fleet.value("recorder", "file").endswith("run-2.rrd"), "another file")
    wait_for_samples(fleet)
    assert fleet.health("recorder").level.name == "WARN"
    assert fleet.stop("drive_sim") == 0
    assert fleet.stop("recorder") == RecordingError.exit_code
    first, second = read_recording(file), read_recording(tmp_path / "run-2.rrd")
    assert not first.complete and second.complete
    assert len(first.samples) + len(second.samples) == number(fleet, "samples written")
    lost = int(second.samples[0, 0] - first.samples[-1, 0]) - 1
    assert lost == number(fleet, "samples lost") and number(fleet, "samples missing") == 0
    assert f"{lost} samples lost: " in fleet.log("recorder")


def test_file_deleted_with_its_folder(fleet: "Fleet", tmp_path: Path) -> None:
    file = tmp_path / "runs" / "run.rrd"
    start(fleet, path=file)
    wait_for_samples(fleet)
    file.unlink()
    file.parent.rmdir()
    fleet.until(lambda: number(fleet, "samples lost") >= 100, "that is noticed")
    fleet.until(lambda: fleet.value("recorder", "file"), "another file")
    fleet.reads("recorder", "deleted or renamed")
    wait_for_samples(fleet)
    assert fleet.stop("drive_sim") == 0
    assert fleet.stop("recorder") == RecordingError.exit_code
    back = read_recording(file)
    assert back.complete and back.samples[0, 0] == number(fleet, "samples lost")


def test_killed_recorder_leaves_what_it_said_was_written(fleet: "Fleet", tmp_path: Path) -> None:
    file = tmp_path / "run.rrd"
    start(fleet, path=file, view="web")
    wait_for_samples(fleet, 1000)
    fleet.until(lambda: fleet.value("recorder", "viewer process"), "a viewer")
    viewer = Path("/proc", fleet.value("recorder", "viewer process"))
    written = number(fleet, "samples written")
    assert fleet.stop("recorder", signal.SIGKILL) == -signal.SIGKILL
    fleet.until(lambda: not viewer.exists(), "its viewer does not outlive it")
    recorded = read_recording(file)
    assert not recorded.complete and recorded.missing == 0
    assert len(recorded.samples) >= written
    np.testing.assert_array_equal(recorded.samples[:, 0], np.arange(len(recorded.samples)))


# --- the drive and the wire -----------------------------------------------------------------

NAMES, SAMPLES = run(200)


class FakeDrive:
    """Publishes blocks as a drive does, and leaves out what a test wants to be lost."""

    def __init__(self, fleet: "Fleet") -> None:
        from ab_msgs_py import topics

        self._fleet, self._lives = fleet, 0
        self._description = topics.DESCRIPTION.publisher(fleet.node)
        self._blocks = topics.BLOCK.publisher(fleet.node)
        fleet.until(lambda: self._blocks.get_subscription_count(), "the recorder listens")

    def start(self) -> None:
        from ab_msgs_py import topics

        self._lives += 1
        before = self._files_begun()
        what = describe(channels=NAMES, run=f"life {self._lives}", effects=[])
        self._description.publish(topics.DESCRIPTION.message(what))
        self._fleet.until(lambda: self._files_begun() > before, "the recorder has heard of it")

    def _files_begun(self) -> int:
        # Where it will record, it says before: that line goes on.
        return len(re.findall(r"recording to \S+\.rrd$", self._fleet.log("recorder"), re.MULTILINE))

    def block(self, first: int, last: int) -> None:
        from ab_msgs_py import Block, topics

        written = number(self._fleet, "samples written")
        self._blocks.publish(topics.BLOCK.message(Block(tuple(NAMES), SAMPLES[first:last])))
        self._fleet.until(
            lambda: number(self._fleet, "samples written") == written + last - first, "it is there"
        )


@pytest.fixture
def drive(fleet: "Fleet", tmp_path: Path) -> Iterator[FakeDrive]:
    fleet.start("recorder", path=tmp_path / "run.rrd")
    yield FakeDrive(fleet)


def test_what_is_lost_on_the_wire_is_counted(
    fleet: "Fleet", drive: FakeDrive, tmp_path: Path
) -> None:
    drive.start()
    drive.block(30, 50)  # who joins a drive under way has lost nothing
    drive.block(57, 60)
    assert number(fleet, "samples missing") == 7
    drive.block(4, 10)  # a reset, of which the first four steps never came
    assert number(fleet, "samples missing") == 11
    drive.start()  # started again: nobody goes back, and yet nothing is a hole but the start
    drive.block(20, 30)
    assert number(fleet, "samples missing") == 31
    drive.block(30, 40)
    assert number(fleet, "messages dropped") == number(fleet, "messages malformed") == 0
    assert fleet.health("recorder").level.name == "WARN"
    assert fleet.stop("recorder") == 0
    firsts = [30, 4, 20]
    for first, name in zip(firsts, ("run.rrd", "run-2.rrd", "run-3.rrd"), strict=True):
        recorded = read_recording(tmp_path / name)
        assert recorded.complete and recorded.samples[0, 0] == first
        assert recorded.missing == (7 if first == 30 else 0)
        steps = recorded.samples[:, 0].astype(int)
        assert recorded.samples.tobytes() == SAMPLES[steps].tobytes()


def test_of_two_drives_in_one_place_one_is_recorded(fleet: "Fleet", tmp_path: Path) -> None:
    """Both are heard in turns, and steps run back at each: not a file for each, and it says so."""
    fleet.start("recorder", path=tmp_path / "run.rrd")
    for name in ("drive_sim", "other"):
        command = (sys.executable, "-m", "ab_sim.nodes.drive_sim", "--ros-args")
        fleet.start_process(name, *command, "-p", "scene:=thesis-hold")
        wait_for_samples(fleet, 500)
    fleet.until(lambda: number(fleet, "messages malformed") > 50, "they take turns")
    assert fleet.health("recorder").level.name == "WARN"
    fleet.reads("recorder", "vibration/block: 2 drives publish it")
    wait_for_samples(fleet, 500)
    fleet.stop("other")
    fleet.stop("drive_sim")
    assert fleet.stop("recorder") == 0
    files = sorted(tmp_path.glob("run*.rrd"))
    assert 2 <= len(files) < number(fleet, "messages malformed") / 5, "not one for each turn"
    assert all(read_recording(file).complete for file in files)


def test_each_run_has_a_file_of_its_own(fleet: "Fleet", tmp_path: Path) -> None:
    """A reset and a simulator that is started again begin another, which never existed."""
    folder = tmp_path / "made" / "by it"
    start(fleet, path=folder / "run.rrd")
    wait_for_samples(fleet)
    assert fleet.call("drive_sim/reset")[0]
    fleet.until(lambda: fleet.value("recorder", "file").endswith("run-2.rrd"), "another file")
    wait_for_samples(fleet)
    assert fleet.stop("drive_sim") == 0
    (folder / "run-3.rrd").write_text("precious")
    fleet.start("drive_sim", scene="thesis-hold", start_paused=True)
    fleet.until(lambda: fleet.value("recorder", "file").endswith("run-4.rrd"), "yet another")
    assert fleet.call("drive_sim/pause", False)[0]
    wait_for_samples(fleet)
    for node in ("drive_sim", "recorder"):
        assert fleet.stop(node) == 0
    assert (folder / "run-3.rrd").read_text() == "precious"
    runs = [read_recording(folder / name) for name in ("run.rrd", "run-2.rrd", "run-4.rrd")]
    assert all(run.complete and run.missing == 0 for run in runs)
    assert [run.samples[0, 0] for run in runs[:2]] == [0, 0]
    assert number(fleet, "samples missing") == int(runs[2].samples[0, 0])
