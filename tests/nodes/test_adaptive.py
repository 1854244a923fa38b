"""An adaptive start-up live, with real nodes: in lock step it is the offline one, bit by bit."""

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.scene import load_scene
from tests.nodes.fleet import Fleet
from tests.nodes.lock_step import PERIOD, LockStep

pytestmark = pytest.mark.ros
SCENE = "adaptive-start-up"
PERIODS = 300


def test_in_lock_step_it_is_the_offline_start_up(fleet: Fleet) -> None:
    live = LockStep(fleet, SCENE)
    live.done("profile_controller/start")
    live.step(commands=0)  # it commands nothing before it has heard a sample
    for _ in range(PERIODS - 1):
        live.step(commands=1)
    drive = Drive(load_scene(SCENE))
    offline = drive.advance(PERIODS * PERIOD)
    heard = live.samples()
    assert heard.channels == offline.channels
    np.testing.assert_array_equal(heard.samples[:, 0], np.arange(PERIODS * PERIOD + 1))
    np.testing.assert_array_equal(heard.samples[1:], offline.samples)
    assert drive.start_up is not None
