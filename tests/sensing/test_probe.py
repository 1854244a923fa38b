"""Proximity probes of a scene: they read how far a point of the deck has moved."""

from typing import Any

import numpy as np
import pytest

from ab_sim.base.errors import SceneError
from ab_sim.control import State
from ab_sim.design.batch import simulate_batch
from ab_sim.drive import Drive
from ab_sim.drive.controllers import AdaptiveController, settings_of
from ab_sim.drive.faults.fault import faults_of
from ab_sim.scene import check_scene, load_scene
from tests.conftest import SceneMaker

CLEAN = {"noise_density": 0.0, "resolution": 0.0, "range": 1.0, "bandwidth": 500.0}
BOTH: dict[str, Any] = {"sensors": {"pickup": {}}, "probes": {"probe": {"axis_angle": 0.3}}}
STEPS = 1500


def test_the_motion_is_the_same_with_and_without(scene: SceneMaker) -> None:
    seen, plain = (Drive(scene(**changes)).advance(STEPS) for changes in (BOTH, {}))
    read = ("pickup_1", "pickup_2", "probe_1", "probe_2")
    assert seen.channels == (*plain.channels, *read)
    assert seen.samples[:, :-4].tobytes() == plain.samples.tobytes()
    alone = Drive(scene(sensors=BOTH["sensors"])).advance(STEPS)
    assert seen.samples[:, :-2].tobytes() == alone.samples.tobytes()


def test_it_reads_the_displacement_on_its_own_axes(scene: SceneMaker) -> None:
    gaps = []
    for step in (1e-3, 1e-4):
        own = {**CLEAN, "bandwidth": 0.5 / step, "sample_rate": 1 / step, "axis_angle": 0.3}
        made = scene(probes={"probe": own}, solver={"step": step})
        run = Drive(made).advance(round(STEPS * 1e-3 / step))
        shown = run["probe_1"] + 1j * run["probe_2"]
        true = (run["x"] + 1j * run["y"]) * np.exp(-0.3j)
        gaps.append(float(np.abs(shown - true).max() / np.abs(true).max()))
    # What is left is the low-pass' delay.
    assert gaps[1] == pytest.approx(0.1 * gaps[0], rel=0.15) and gaps[0] < 0.1


def test_what_the_usual_one_reads_is_rough_and_clipped(scene: SceneMaker) -> None:
    fine, rough = (
        Drive(scene(probes={"probe": {"noise_density": 0.0, **own}})).advance(2500)["probe_1"]
        for own in ({"resolution": 0.0}, {"resolution": 1e-6, "range": 2e-5})
    )
    assert np.abs(rough).max() == pytest.approx(2e-5) and np.abs(fine).max() > 4e-5
    within = np.abs(fine) < 1.9e-5
    assert 1e-7 < np.abs(rough - fine)[within].max() <= 0.5e-6 * (1 + 1e-9)


def test_in_space_it_looks_at_a_point_of_the_deck() -> None:
    point = [0.05, -0.02, 0.03]
    raw = load_scene("couple-unbalance", ["duration=1"]).as_mapping()
    step = raw["solver"]["step"]  # type: ignore[index]
    wide = {**CLEAN, "position": point, "bandwidth": 0.5 / step, "sample_rate": 1.0 / step}
    run = Drive(check_scene({**raw, "probes": {"probe": wide}}, "test")).advance(round(1.0 / step))
    shown = np.column_stack([run[f"probe_{axis}"] for axis in (1, 2, 3)])
    w, *imaginary = run.turn.T
    v = np.array(imaginary).T
    turned = point + 2.0 * np.cross(v, np.cross(v, point) + w[:, None] * point)
    moved = run.position + turned - point
    assert np.abs(run.position - moved).max() > 0.3 * np.abs(moved).max(), "it tilts"
    assert np.abs(shown - moved).max() < 0.1 * np.abs(moved).max()


def test_a_batch_has_its_readings_to_the_bit(scene: SceneMaker) -> None:
    made = scene(probes={"probe": {}}, duration=0.2)
    batch = simulate_batch(made, [{"balls.mass": 1e-3}, {"probes.probe.seed": 3}], every=2)
    for run in batch.runs:
        own = Drive(run.scene).advance(200, every=2)
        assert run.trajectory["probe_1"].tobytes() == own["probe_1"].tobytes()
    assert np.any(batch.runs[0].trajectory["probe_1"] != batch.runs[1].trajectory["probe_1"])


def test_an_adaptive_start_up_is_told_of_displacement() -> None:
    changes = ["probes.probe={noise_density: 5e-8, bandwidth: 400, range: 3 mm}"]
    made = load_scene("adaptive-start-up", [*changes, "profile.sensor=probe"])
    sensing = settings_of(made).sensing
    assert (sensing.quantity, sensing.axes) == ("displacement", 2)
    assert 1e-7 < sensing.noise < 2e-6
    drive = Drive(made)
    assert isinstance(drive.controller, AdaptiveController)
    while not drive.controller.start_up.state.over and drive.time < 12.0:
        drive.advance(500)
    assert drive.controller.start_up.state is State.DONE
    assert drive.controller.start_up.estimates.critical_speed == pytest.approx(100.0, rel=0.02)


def test_a_probe_may_drop_out() -> None:
    made = load_scene("adaptive-start-up", ["probes.probe={}", "profile.sensor=probe"])
    drive = Drive(made, faults=faults_of(["probe drops"]))
    drive.advance(500)
    assert isinstance(drive.controller, AdaptiveController)
    assert drive.controller.start_up.state is State.WAITING


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"sensors": {"one": {}}, "probes": {"one": {}}},
            "probes.one: a sensor ",
        ),
        ({"probes": {"one": {"position": [0.1, 0, 0]}}}, "probes.one.position: "),
        ({"probes": {"one": {"range": 0}}}, "probes.one.range = 0: "),
        ({"probes": {"one": {"resolution": 2e-3}}}, "probes.one.resolution = 0.002 m: "),
        ({"probes": {"one": {"bandwidth": 501}}}, "probes.one.bandwidth = 501 Hz: "),
        ({"probes": {"one": {"rang": 1}}}, "probes.one.rang = 1: .*did you mean"),
        ({"probes": {"deck": {}}}, "name deck is"),
    ],
)
def test_what_makes_no_sense_is_refused(
    scene: SceneMaker, changes: dict[str, Any], words: str
) -> None:
    with pytest.raises(SceneError, match=words):
        scene(**changes)
