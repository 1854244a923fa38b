"""Another disc: nothing moves as it comes, and what follows is its own."""

import math
from typing import Any

import numpy as np
import pytest

from ab_sim.base.errors import SceneError
from ab_sim.drive import Drive
from ab_sim.drive.disc import with_disc
from ab_sim.drive.observation import Observation
from ab_sim.scene import load_scene


def spun(scene: Any) -> Drive:
    drive = Drive(scene, commanded=True)
    drive.command(150.0)
    drive.advance(2500)
    return drive


def with_other(drive: Drive, eccentricity: float, further: float) -> Drive:
    scene, moved = with_disc(drive.scene, eccentricity, further)
    other = Drive(scene, commanded=True)
    other.restore(moved(drive.snapshot()))
    return other


def places(now: Observation) -> np.ndarray:
    """What anybody sees who does not see the unbalance."""
    balls = np.exp(1j * (now.psi + now.theta))
    return np.concatenate([now.position, now.velocity, balls.real, balls.imag, now.theta_rate])


@pytest.mark.parametrize("further", [0.0, 0.3, -2.0, math.pi, 40.0])
def test_nothing_moves_as_it_comes(scene: Any, further: float) -> None:
    drive = spun(scene())
    other = with_other(drive, 3e-4, further)
    before, after = drive.observe(), other.observe()
    assert places(after) == pytest.approx(places(before), rel=1e-12, abs=1e-12)
    assert (after.time, after.command) == (before.time, before.command)
    assert after.psi == pytest.approx(before.psi + further, abs=1e-11)


def test_without_unbalance_its_direction_means_nothing(scene: Any) -> None:
    drive = with_other(spun(scene()), 0.0, 0.0)
    other = with_other(drive, 0.0, 1.234)
    drive.advance(1000)
    other.advance(1000)
    assert np.abs(drive.observe().position).max() > 1e-6, "there is something to be compared"
    assert places(other.observe()) == pytest.approx(places(drive.observe()), abs=1e-9)


def test_the_same_disc_turned_to_and_fro_is_the_same(scene: Any) -> None:
    drive = spun(scene())
    other = with_other(with_other(drive, 1e-4, 2.5), 1e-4, -2.5)
    drive.advance(1000)
    other.advance(1000)
    assert places(other.observe()) == pytest.approx(places(drive.observe()), abs=1e-9)


def test_a_heavier_unbalance_shakes_more(scene: Any) -> None:
    light, heavy = spun(scene()), spun(scene())
    heavy = with_other(heavy, 5e-4, 0.0)
    whirls = [np.median(each.advance(2000).whirl) for each in (light, heavy)]
    assert whirls[1] > whirls[0]


def test_a_race_off_the_shaft_stays_where_it_is(scene: Any) -> None:
    runout = {"offset_1": 1e-4, "offset_2": 2e-4, "lobe": 1e-5, "lobe_angle": 0.2}
    before = scene(effects={"race_runout": runout})
    after = with_disc(before, 1e-4, 0.7)[0].effects["race_runout"]
    assert complex(after.offset_1, after.offset_2) * np.exp(0.7j) == pytest.approx(1e-4 + 2e-4j)
    assert after.lobe_angle == pytest.approx(-0.5)


def test_no_such_disc(scene: Any) -> None:
    with pytest.raises(SceneError, match="rotor.eccentricity = 1e-13 m: "):
        with_disc(scene(), 1e-13, 0.0)
    with pytest.raises(SceneError, match="disc_angle = 1 rad: rotor.inertia of"):
        with_disc(load_scene("couple-unbalance"), 1e-4, 1.0)
