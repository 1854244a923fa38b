"""The web viewer of a running drive, in a real browser: what the page shows."""

import re
import signal
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from ab_sim.base.palette import UNBALANCE, ball_colour
from ab_sim.show.viewing.page import newest_times
from tests.nodes.conftest import fleet
from tests.viewing.browser import Screen, browser, like
from tests.waiting import until

__all__ = ["fleet"]
pytestmark = [pytest.mark.ros, pytest.mark.long, pytest.mark.timeout(1200)]

PATIENCE = 400.0
"""Time in which a picture, which is drawn by software here, has to show something [s]."""
soon = partial(until, deadline=PATIENCE, every=1.0)


def is_drawn(screen: Screen) -> bool:
    """Return whether the colours of balls, unbalance and curves are there."""
    pixels = screen.pixels()
    return all(
        like(pixels, color).sum() > 20 for color in (ball_colour(0), ball_colour(1), UNBALANCE)
    )


def newest(screen: Screen) -> float:
    """Return the newest time of the run that the page has [s]."""
    return max(newest_times(screen.viewer_state()).values(), default=0.0)


def test_a_page_starts_a_run_and_shows_it_and_one_that_comes_late_has_all_of_it(
    fleet: "Fleet",  # noqa: F811, F821
    tmp_path: Path,
) -> None:
    command = [sys.executable, "-m", "ab_sim", "live", "balanced-start-up", "--view", "web"]
    command += ["--set", "solver.step=0.004"]  # a picture drawn by software leaves little time
    live = [*command, "--for", "4", "--record", tmp_path / "run.rrd"]
    fleet.start_process("live", *live)
    fleet.reads("live", "the run starts when the page is open")
    address = re.search(r"watch it at (\S+)", fleet.log("live"))[1]
    # The run lasts until the first picture is there.
    assert fleet.set("drive_sim", speed_factor=0.01)[0]
    with browser() as screen:
        screen.open(address)
        soon(lambda: is_drawn(screen), "the balls, the unbalance and the curves are drawn")
        before = screen.pixels()
        assert "the run is over" not in fleet.log("live")
        assert fleet.set("drive_sim", speed_factor=1.0)[0]
        soon(
            lambda: (np.abs(screen.pixels() - before).max(axis=-1) > 60.0).sum() > 200,
            "they move",
        )
        assert is_drawn(screen), "and are still drawn"
        fleet.reads("live", "the run is over")
        screen.open(address)
        soon(lambda: is_drawn(screen), "the late page draws them, too")
        soon(lambda: newest(screen) > 3.9, "the late page has the whole run")
        strangers = {
            url
            for url in screen.answered
            if not url.startswith(("http://127.0.0.1:", "data:", "blob:"))
        }
        assert not strangers, "nobody is asked but the viewer"
    assert fleet.stop("live", signal.SIGINT) == 0
