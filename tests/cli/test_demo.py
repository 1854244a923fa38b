"""`make demo`'s command, whole: three processes, real time, a recording and a picture."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="needs ROS 2")

from ab_sim.analysis import replay  # noqa: E402
from ab_sim.drive.trajectory import Trajectory  # noqa: E402
from ab_sim.recording import read_recording  # noqa: E402
from ab_sim.scene import check_scene, load_scene  # noqa: E402
from ab_sim.spindle.segments_course import PERIOD  # noqa: E402
from tests.domains import own_domain  # noqa: E402

pytestmark = pytest.mark.ros


HOLD = load_scene("balanced-start-up").profile.variable_speed_period
PUNCTUAL, TRIES = 0.03, 3
"""s that a command may be late at most where the drive's balance is judged: of commands that were
late now and then, by 0.02 s on average, the peak whirl changed by 6 %, of 0.05 s by 30 %, and not
all drives were balanced."""


class Demo(NamedTuple):
    """One that is over."""

    out: Path
    said: str
    scene: dict[str, Any]
    live: Trajectory
    """Read back through Rerun's own API, as the scene is."""


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Demo:
    """The first demo that the machine had time for."""
    found = []
    for _ in range(TRIES):
        over = demo(tmp_path_factory.mktemp("demo") / "out")
        found.append(latest(over.live))
        if found[-1] < PUNCTUAL:
            return over
    raise AssertionError(f"this machine is too busy for real time: commands came {found} s late")


def demo(out: Path) -> Demo:
    """The command, whole."""
    root = Path(__file__).resolve().parents[2]
    with own_domain() as domain:
        done = subprocess.run(
            [sys.executable, "-m", "ab_sim", "demo", "--view", "web", "--out", str(out)],
            capture_output=True,
            text=True,
            cwd=root,
            env={
                **{k: v for k, v in os.environ.items() if k != "DISPLAY"},
                "ROS_DOMAIN_ID": str(domain),
                "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            },
            timeout=240,
        )
    assert done.returncode == 0, done.stdout + done.stderr
    recorded = read_recording(out / "startup.rrd")
    assert recorded.missing == 0
    live = Trajectory(recorded.channels, recorded.samples)
    return Demo(out, done.stdout, recorded.description["scene"], live)


def latest(live: Trajectory) -> float:
    """How late a command was at most [s]: on ramps each 5 ms has its own, and one ends the hold."""
    changed = np.flatnonzero(np.diff(live["command"])) + 1
    gaps = np.diff(live["time"][changed])
    held = live["command"][changed[:-1]] == HOLD.start_speed
    assert np.count_nonzero(held) == 1
    return float(np.max(gaps - np.where(held, HOLD.duration, PERIOD)))


def test_says_what_it_did(finished: Demo) -> None:
    for words in (
        "peak W/e", "final W/e", "residual unbalance", "... / without balls",
        "period", "final ball angles", "real-time factor", "worst lateness",
        "steps dropped", "messages lost", "startup.rrd", "startup.png", "of 9 s",
        "watch it at http://127.0.0.1:",
    ):  # fmt: skip
        assert words in finished.said


def test_recorded_ball_angles_equal_an_offline_run(finished: Demo) -> None:
    """Against the same command history: 1e-9 rad."""
    live = finished.live
    # The demo lasts until a sample of this time is heard, and may stop the drive right there.
    assert live["time"][-1] >= finished.scene["duration"] == 9.0
    assert len(set(live["command"].tolist())) > 100
    offline = replay(check_scene(finished.scene, "recording"), live)
    np.testing.assert_allclose(offline.ball_angles, live.ball_angles, rtol=0, atol=1e-9)


def test_the_drive_gets_balanced(finished: Demo) -> None:
    """Ours offline: 0.107 e in the end. Live, where balls stick differs by a few degrees."""
    live = finished.live
    assert live.whirl.max() / 1e-4 == pytest.approx(26.9, rel=0.1)
    assert live.whirl[-500:].max() / 1e-4 < 0.3, "1.34 without balls"


def test_picture(finished: Demo) -> None:
    from matplotlib import image

    picture = image.imread(finished.out / "startup.png")
    assert picture.shape[0] > 900 and picture.shape[1] > 900
    assert picture[..., :3].std() > 0.05, "something is drawn"
