"""The web viewer of a running drive, in a real browser: what the page shows."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from ab_sim.palette import UNBALANCE, ball_colour
from tests.viewing.browser import Screen, browser, like
from tests.waiting import until

pytestmark = [pytest.mark.ros, pytest.mark.timeout(600)]

ROOT = Path(__file__).resolve().parents[2]
soon = partial(until, deadline=400.0, every=1.0)
"""A picture is drawn by software here."""


@pytest.fixture
def running(domain: int) -> Iterator[str]:
    """The address of the viewer of a drive that runs."""
    pytest.importorskip("rclpy", reason="needs ROS 2")
    command = [sys.executable, "-m", "ab_sim", "live", "balanced-start-up", "--view", "web"]
    command += ["--set", "solver.step=0.004"]  # a picture drawn by software leaves little time
    live = subprocess.Popen(
        [*command, "--for", "3600"],
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
        yield said[-1].split()[-1]
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


def test_shows_the_views_of_a_drive_that_runs(running: str) -> None:
    with browser() as screen:
        screen.open(running)
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
