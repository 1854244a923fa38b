"""A drive and its profile controller, both put back: from there they go on to the same bits."""

from pathlib import Path

import numpy as np
import pytest

from tests.nodes.fleet import Fleet
from tests.nodes.lock_step import PERIOD, LockStep

pytestmark = pytest.mark.ros
BRISK = (
    "{kind: segments, segments: [{to: 20, acceleration: 200}, "
    "{until: {vibration_rms_below: 30, over: 0.05, at_most: 0.5}}, {to: 30, acceleration: 200}]}"
)


@pytest.mark.parametrize("profile", ["", BRISK], ids=["adaptive", "segments"])
def test_both_put_back_go_on_to_the_same_bits(fleet: Fleet, tmp_path: Path, profile: str) -> None:
    live = LockStep(fleet, "adaptive-start-up", profile)
    kept = {name: tmp_path / f"{name}.json" for name in ("drive_sim", "profile_controller")}
    for node, path in kept.items():
        assert fleet.set(node, snapshot=str(path))[0]
    live.done("profile_controller/start")
    live.step(commands=1 if profile else 0)
    for _ in range(25):
        live.step(commands=1)
    for node in kept:
        assert "t = 0.13 s" in live.done(f"{node}/save_snapshot")
    status = live.status
    for _ in range(40):
        live.step(commands=1)
    first, after = live.samples(), live.status
    for order in (list(kept), list(kept)[::-1]):
        live.blocks.clear()
        for node in order:
            assert "t = 0.13" in live.done(f"{node}/restore_snapshot") or node == "drive_sim"
        fleet.until(lambda: live.status == status, "what it did then")
        for _ in range(40):
            live.step(commands=1)
        again = live.samples()
        count = 40 * PERIOD
        np.testing.assert_array_equal(again.samples[-count:], first.samples[-count:])
        assert live.status == after
