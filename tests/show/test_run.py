"""The figure of a run is drawn for every kind of scene, without a display, and says what is so."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib import image
from matplotlib.figure import Figure

from ab_sim.analysis import Compared, Comparison, compare_run, run_scene
from ab_sim.analysis.metrics import Metrics, metrics_of
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene import Scene, load_scene
from ab_sim.show.curves import draw_curve
from ab_sim.show.run import drawn_run
from ab_sim.show.saved import save
from tests.analysis.test_circulation import STALLING
from tests.show.collisions import overlaps, written

ALONE = Comparison(None, None)


def texts_of(scene: Scene, file: Path, comparison: Comparison = ALONE) -> str:
    """The figure as SVG, with text as text, not as outlines."""
    run = run_scene(scene)
    with matplotlib.rc_context({"svg.fonttype": "none"}):
        figure = drawn_run(run.trajectory, scene, comparison, run.variable_speed_period)
        save(figure, file, 120)
    return file.read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["thesis-hold", "no-ball", "one-ball", "nsc-case-1"])
def test_every_kind_of_scene(name: str, tmp_path: Path) -> None:
    scene = load_scene(name, ["duration=4"])
    result = run_scene(scene)
    file = tmp_path / "figure.png"
    save(result.plot(), file, 120)
    assert image.imread(file)[..., :3].std() > 0.05


def test_the_whirl_fills_its_panel(tmp_path: Path, drawn: list[Figure]) -> None:
    texts_of(load_scene("no-ball"), tmp_path / "figure.svg")
    (whirl,) = (axes for axes in drawn[0].axes if axes.get_ylabel().startswith("whirl radius"))
    low, high = whirl.get_ylim()
    peak = max(
        float(np.nanmax(line.get_ydata())) for line in whirl.lines if len(line.get_ydata()) > 2
    )
    assert low < peak < high < 10.0 * peak


def test_nothing_is_drawn_of_balls_that_are_not_there(tmp_path: Path) -> None:
    text = texts_of(load_scene("no-ball"), tmp_path / "figure.svg")
    assert "Start-up of no-ball" in text and "whirl radius W/e" in text
    assert "ball" not in text.replace("no-ball", "")


def test_a_speed_change_is_called_that_and_180_deg_is_shown_as_minus_180(tmp_path: Path) -> None:
    """Both balls sit at +180 deg."""
    text = texts_of(load_scene("nsc-case-1", ["duration=12"]), tmp_path / "figure.svg")
    assert "Speed change of nsc-case-1" in text and "Start-up" not in text
    assert text.count("opposite the unbalance") == 1
    assert ">−180<" in text and ">180<" not in text


def test_balls_that_circulate_are_drawn_by_their_speed(scene: Any, tmp_path: Path) -> None:
    """Hundreds of turns would be as many ticks."""
    text = texts_of(scene(**STALLING), tmp_path / "figure.svg")
    assert "speed of the balls" in text and "6 balls circulate" in text
    assert "ball angle from" not in text and "opposite the unbalance" not in text
    assert "6 of 6 at 97" in text, "in the line that sums it up"


def test_runs_beside_it_are_drawn_and_named_with_their_final_whirl(tmp_path: Path) -> None:
    run = run_scene(load_scene("balanced-start-up"))
    text = texts_of(run.scene, tmp_path / "figure.svg", compare_run(run))
    for words in ("0.107  this run", "1.34  without balls", "0.85  without", "residual unbalance"):
        assert words in text
    assert "0.0796 times that without balls" in text


def test_a_motor_shows_commanded_and_actual_speed_and_what_it_can_give(
    scene: Any, tmp_path: Path
) -> None:
    motor = {"rotor_inertia": 2.9e-5, "torque_limit": 1e-3, "proportional_gain": 1e-3}
    made = scene(effects={"motor": motor}, duration=0.5)
    text = texts_of(made, tmp_path / "figure.svg")
    for words in ("commanded", "spindle speed", "motor torque [N m]", "largest torque"):
        assert words in text


def test_a_deck_in_space_shows_its_height_and_tilt(tmp_path: Path) -> None:
    lifted = ["rotor.height=0.004", "race.height=0.006", "duration=0.3"]
    text = texts_of(load_scene("feeding-deck", lifted), tmp_path / "figure.svg")
    for words in ("height z [um]", "tilt [mrad]", "alpha, about x<", "gamma, about the shaft<"):
        assert words in text
    level = texts_of(load_scene("feeding-deck", lifted[-1:]), tmp_path / "level.svg")
    assert "height z" not in level and "alpha, about x: 0" in level, "nothing to see"
    wobble = texts_of(load_scene("couple-unbalance", lifted[-1:]), tmp_path / "wobble.svg")
    assert "height z" not in wobble and "tilt" in wobble, "it rises by rounding only"
    plane = texts_of(load_scene("no-ball", lifted[-1:]), tmp_path / "plane.svg")
    assert "tilt" not in plane


def test_many_balls_and_no_eccentricity(scene: Any, tmp_path: Path) -> None:
    made = scene(
        balls={"count": 64, "mass": 1e-4},
        rotor={"eccentricity": 0.0},
        start={"ball_angles": [0.1 * i for i in range(64)]},
        solver={"step": 5e-4},
        duration=0.5,
    )
    text = texts_of(made, tmp_path / "figure.svg")
    assert "<svg" in text and "W [mm]" in text


def test_swings_too_fast_to_be_seen_become_a_range_and_their_mean() -> None:
    time = np.linspace(0, 10, 10001)
    axes = Figure().subplots()
    draw_curve(axes, time, 3 + np.sin(2 * np.pi * 40 * time), color="k")
    (line,), (band,) = axes.lines, axes.collections
    assert np.ptp(line.get_ydata()[500:-500]) < 0.05, "the mean"
    low, high = band.get_datalim(axes.transData).intervaly
    assert (low, high) == pytest.approx((2, 4), abs=0.01)
    slow = Figure().subplots()
    draw_curve(slow, time, 3 + np.sin(2 * np.pi * time), color="k")
    assert not slow.collections and np.ptp(slow.lines[0].get_ydata()) == pytest.approx(2, abs=1e-3)


def test_figures_need_no_pyplot() -> None:
    """Which keeps every figure in memory, and would choose a window system."""
    modules = ", ".join(f"ab_sim.show.{m}" for m in ("run", "costs"))
    code = f"import sys, {modules}; sys.exit('matplotlib.pyplot' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


def test_the_triangle_covers_nothing_that_is_written(tmp_path: Path, drawn: list[Figure]) -> None:
    """Where the whirl is in its band from its peak on, and another run makes the axis long."""
    run = run_scene(load_scene("no-ball", ["duration=0.2"]))
    samples = run.trajectory.samples.copy()
    size = np.full(len(samples), 1e-4)
    middle = len(size) // 2
    size[:middle] *= 0.5
    size[middle] *= 1.09
    for name, values in (("x", size), ("y", 0.0)):
        samples[:, run.trajectory.channels.index(name)] = values
    stepped = Trajectory(run.trajectory.channels, samples)
    time, small = stepped["time"], 1e-3 * size
    judged = metrics_of(stepped, run.scene)
    calm = Compared(
        Metrics({**judged.values, Metrics.final_whirl.key: 1e-7}, 1e-4),
        time,
        small,
        stepped["speed"],
    )
    figure = drawn_run(stepped, run.scene, Comparison(None, calm))
    save(figure, tmp_path / "figure.png", 120)
    panel = drawn[-1].axes[1]
    (triangle,) = (line for line in panel.lines if line.get_marker() == "v")
    (peak,) = (text for text in panel.texts if text.get_text().startswith("peak"))
    assert triangle.get_xdata()[0] == pytest.approx(judged.peak_time, abs=2e-3)
    drawn[-1].draw_without_rendering()
    assert not triangle.get_window_extent().overlaps(peak.get_window_extent())
    assert not list(overlaps(written(drawn[-1])))
