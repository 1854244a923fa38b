"""`make demo`'s command, whole: three processes, real time, a recording and a picture."""

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="needs ROS 2")

from ab_sim.analysis import run_scene  # noqa: E402
from ab_sim.drive.trajectory import Trajectory  # noqa: E402
from ab_sim.scene import check_scene  # noqa: E402
from tests.domains import own_domain  # noqa: E402
from tests.recorded import read_recording  # noqa: E402
from tests.waiting import PATIENCE  # noqa: E402

pytestmark = pytest.mark.ros


class Demo(NamedTuple):
    """One that is over."""

    out: Path
    said: str
    scene: dict[str, Any]
    live: Trajectory
    """Read back through Rerun's own API, as the scene is."""


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Demo:
    """The command, whole."""
    out = tmp_path_factory.mktemp("demo") / "out"
    root = Path(__file__).resolve().parents[2]
    with own_domain() as domain:
        demo = subprocess.Popen(
            [sys.executable, "-m", "ab_sim", "demo", "--view", "web", "--now", "--out", str(out)],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            cwd=root,
            env={
                **{k: v for k, v in os.environ.items() if k != "DISPLAY"},
                "PYTHONUNBUFFERED": "1",
                "ROS_DOMAIN_ID": str(domain),
                "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            },
        )
        try:
            assert demo.stdout is not None
            said = ""
            for line in demo.stdout:
                said += line
                if line.startswith("the run is over"):
                    demo.send_signal(signal.SIGINT)
            assert demo.wait(PATIENCE) == 0, said
        finally:
            demo.kill()
            demo.wait()
    recorded = read_recording(out / "startup.rrd")
    assert recorded.missing == 0
    live = Trajectory(recorded.channels, recorded.samples)
    return Demo(out, said, recorded.description["scene"], live)


def test_says_what_it_did(finished: Demo) -> None:
    for words in (
        "peak W/e", "final W/e", "residual unbalance", "... / without balls",
        "period", "final ball angles", "real-time factor", "worst lateness",
        "steps dropped", "messages lost", "identical to the last bit", "startup.rrd",
        "startup.png", "of 9 s", "watch it at http://127.0.0.1:",
        "starting three nodes", "comparing with an offline run",
    ):  # fmt: skip
        assert words in finished.said


def test_the_recording_is_the_offline_run(finished: Demo) -> None:
    """However busy the machine is: every sample but the first, taken before it was commanded."""
    live = finished.live
    # The demo lasts until a sample of this time is heard, and may stop the drive right there.
    assert live["time"][-1] >= finished.scene["duration"] == 9.0
    offline = run_scene(check_scene(finished.scene, "recording"))
    steps = len(offline.trajectory)
    assert np.array_equal(live.samples[1:steps], offline.trajectory.samples[1:])
    assert offline.metrics.balanced and f"{offline.metrics.residual_unbalance:.3g}" in finished.said


def test_picture(finished: Demo) -> None:
    from matplotlib import image

    picture = image.imread(finished.out / "startup.png")
    assert picture.shape[0] > 900 and picture.shape[1] > 900
    assert picture[..., :3].std() > 0.05, "something is drawn"
