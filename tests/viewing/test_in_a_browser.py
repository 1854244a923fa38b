"""The web viewer of a running drive, in a real browser: what the page shows."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from ab_sim.base.palette import UNBALANCE, ball_colour
from ab_sim.show.viewing.page import newest_times
from tests.viewing.browser import Screen, browser, like
from tests.waiting import until

pytestmark = [pytest.mark.ros, pytest.mark.long, pytest.mark.timeout(600)]

ROOT = Path(__file__).resolve().parents[2]
soon = partial(until, deadline=400.0, every=1.0)
"""A picture is drawn by software here."""


class Live(NamedTuple):
    """`ab-sim live`, which waits for a browser."""

    process: "subprocess.Popen[str]"
    address: str


@pytest.fixture
def live(domain: int, tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Live]:
    """One that runs for as many seconds as the test's mark says."""
    pytest.importorskip("rclpy", reason="needs ROS 2")
    command = [sys.executable, "-m", "ab_sim", "live", "balanced-start-up", "--view", "web"]
    command += ["--set", "solver.step=0.004"]  # a picture drawn by software leaves little time
    command += ["--for", str(request.param), "--record", str(tmp_path / "run.rrd")]
    live = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        cwd=ROOT,
        env={**os.environ, "PYTHONUNBUFFERED": "1", "ROS_DOMAIN_ID": str(domain)},
    )
    assert live.stdout is not None
    said = []
    try:
        for line in live.stdout:
            said.append(line)
            if line.startswith("watch it at "):
                break
        assert said and said[-1].startswith("watch it at "), said
        yield Live(live, said[-1].split()[-1])
        live.send_signal(signal.SIGINT)
        rest, _ = live.communicate(timeout=60.0)
        assert live.returncode == 0, rest
    finally:
        live.kill()
        live.wait()


def drawn(screen: Screen) -> bool:
    """Whether balls, unbalance and curves are there, in the colours in which they are drawn."""
    pixels = screen.pixels()
    return all(
        like(pixels, color).sum() > 20 for color in (ball_colour(0), ball_colour(1), UNBALANCE)
    )


def newest(screen: Screen) -> float:
    """How much of the run the page has [s]."""
    return max(newest_times(screen.viewer_state()).values(), default=0.0)


@pytest.mark.parametrize("live", [3600], indirect=True)
def test_shows_the_views_of_a_drive_that_runs(live: Live) -> None:
    with browser() as screen:
        screen.open(live.address)
        soon(lambda: drawn(screen), "the balls, the unbalance and the curves are drawn")
        before = screen.pixels()
        soon(
            lambda: (np.abs(screen.pixels() - before).max(axis=-1) > 60.0).sum() > 200,
            "they move",
        )
        assert drawn(screen), "and are still drawn"
        strangers = {
            url
            for url in screen.answered
            if not url.startswith(("http://127.0.0.1:", "data:", "blob:"))
        }
        assert not strangers, "nobody is asked but the viewer"


@pytest.mark.parametrize("live", [2], indirect=True)
def test_starts_with_the_page_and_shows_the_run_after_its_end(live: Live) -> None:
    with browser() as screen:
        screen.open(live.address)
        assert live.process.stdout is not None
        assert any(line.startswith("the run is over") for line in live.process.stdout)
    with browser() as screen:  # another one, which comes late
        screen.open(live.address)
        soon(lambda: drawn(screen), "the balls, the unbalance and the curves are drawn")
        soon(lambda: newest(screen) > 1.9, "the page has the whole run")
