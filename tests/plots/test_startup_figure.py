"""The start-up figure is drawn for every kind of scene, without a display."""

from pathlib import Path
from typing import Any

import matplotlib
import pytest
from matplotlib import image

from ab_sim.analysis import run_scene
from ab_sim.plots import startup_figure
from ab_sim.scene import load_scene


@pytest.mark.parametrize("name", ["thesis-hold", "no-ball", "one-ball", "nsc-case-1"])
def test_every_kind_of_scene(name: str, tmp_path: Path) -> None:
    scene = load_scene(name, ["duration=4"])
    result = run_scene(scene)
    file = tmp_path / "figure.png"
    startup_figure(result.trajectory, scene, file, result.variable_speed_period)
    assert image.imread(file)[..., :3].std() > 0.05


def test_a_motor_shows_commanded_and_actual_speed_and_torque(scene: Any, tmp_path: Path) -> None:
    motor = {"rotor_inertia": 2.9e-5, "torque_limit": 1e-3, "proportional_gain": 1e-3}
    made = scene(effects={"motor": motor}, duration=0.5)
    file = tmp_path / "figure.svg"
    # Text as text, not as outlines.
    with matplotlib.rc_context({"svg.fonttype": "none"}):
        startup_figure(run_scene(made).trajectory, made, file)
    for words in ("commanded", "actual", "motor torque [N m]", "torque limit"):
        assert words in file.read_text()


def test_many_balls_and_no_eccentricity(scene: Any, tmp_path: Path) -> None:
    made = scene(
        balls={"count": 64, "mass": 1e-4},
        rotor={"eccentricity": 0.0},
        start={"ball_angles": [0.1 * i for i in range(64)]},
        solver={"step": 5e-4},
        duration=0.5,
    )
    file = tmp_path / "figure.svg"
    startup_figure(run_scene(made).trajectory, made, file)
    assert "<svg" in file.read_text()
