"""Accelerometers of a scene: they read specific force, by their names, and do nothing else."""

from typing import Any

import numpy as np
import pytest

from ab_sim.base.errors import SceneError
from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene import Scene, check_scene, load_scene
from ab_sim.scene.load import changed_scene
from tests.effects.parts import scene_of

STANDARD_GRAVITY = 9.80665
"""m/s^2."""
CLEAN = {"noise_density": 0.0, "resolution": 0.0, "range": 1e6, "bandwidth": 500.0}
TURNED = {"pickup": {"axis_angle": 0.3}}
REST = {
    "rotor": {"eccentricity": 0.0},
    "start": {"speed": 0.0, "ball_angles": [-np.pi / 2, -np.pi / 2]},
    "profile": None,
}
STEPS = 300


def on_edge(sensors: Any, down: float = -np.pi / 2, **changes: Any) -> Scene:
    """The thesis' drive near its critical speed, its shaft level."""
    gravity = {"effects": {"gravity": {"tilt": np.pi / 2, "direction": down}}}
    return scene_of("smooth", gravity, {"sensors": sensors, **changes})


def run(scene: Scene, steps: int = STEPS) -> Trajectory:
    return Drive(scene).advance(steps)


def read(trajectory: Trajectory, name: str = "pickup") -> np.ndarray:
    """Readings of both axes as complex numbers."""
    return trajectory[f"{name}_1"] + 1j * trajectory[f"{name}_2"]


def test_the_motion_is_the_same_with_and_without() -> None:
    seen, plain = run(on_edge(TURNED)), run(on_edge({}))
    assert seen.channels == (*plain.channels, "pickup_1", "pickup_2")
    assert seen.samples[:, :-2].tobytes() == plain.samples.tobytes()
    assert np.ptp(read(seen).real) > 1.0 and np.ptp(read(seen).imag) > 1.0, "it sees something"


def test_hanging_at_rest_it_shows_g_upwards_on_its_own_axes() -> None:
    at_rest = run(on_edge({"pickup": {**CLEAN, "axis_angle": 0.3}}, **REST))
    upwards = STANDARD_GRAVITY * np.array([np.sin(0.3), np.cos(0.3)])
    assert at_rest.samples[-1, -2:] == pytest.approx(upwards, rel=1e-9)


def test_turned_with_the_scene_it_reads_the_same_and_alone_on_turned_axes() -> None:
    still = {"pickup": {**CLEAN, "axis_angle": 0.3}}
    turned = {"pickup": {**CLEAN, "axis_angle": 1.0}}
    start = {"speed": 90.0, "ball_angles": [0.3, -0.9], "angle": 0.7}
    one, alone = read(run(on_edge(still))), read(run(on_edge(turned)))
    with_scene = read(run(on_edge(turned, -np.pi / 2 + 0.7, start=start)))
    assert np.abs(with_scene - one).max() < 1e-6 * np.abs(one).max()
    assert np.abs(alone - one * np.exp(-0.7j)).max() < 1e-9 * np.abs(one).max()


def test_it_clips_at_its_range() -> None:
    scene = on_edge({"pickup": {"axis_angle": 0.3, "range": 8.0}})
    shown = np.abs(run(scene)["pickup_1"])
    digit = scene.sensors["pickup"].resolution
    clipped = shown > 8.0 - digit
    assert clipped.any() and not clipped.all()
    assert shown.max() <= 8.0 + 0.5 * digit, "the range, to the nearest digit"


def test_without_its_imperfections_it_reads_the_force_but_for_the_delay() -> None:
    gaps = []
    for step in (1e-3, 1e-4):
        open_wide = {**CLEAN, "bandwidth": 0.5 / step, "sample_rate": 1.0 / step}
        out = run(on_edge({"pickup": open_wide}, solver={"step": step}), round(0.3 / step))
        force = out["ax"] + 1j * (out["ay"] + STANDARD_GRAVITY)
        gaps.append(float(np.abs(read(out) - force)[len(force) // 2 :].max()))
    assert gaps[1] == pytest.approx(0.1 * gaps[0], rel=0.15)


def test_several_read_each_by_its_own() -> None:
    """In the order of the scene, each as it would alone; also after going back."""
    fine = {"bandwidth": 300.0, "seed": 5}
    drive = Drive(on_edge({**TURNED, "ball_9_angle": fine}))
    both = drive.advance(STEPS)
    assert both.balls == 2, "a name is a name"
    assert both.channels[-4:] == ("pickup_1", "pickup_2", "ball_9_angle_1", "ball_9_angle_2")
    for name, alone in (("pickup", TURNED), ("ball_9_angle", {"ball_9_angle": fine})):
        assert read(both, name).tobytes() == read(run(on_edge(alone)), name).tobytes()
    assert drive.present().samples[0, -4:].tobytes() == both.samples[-1, -4:].tobytes()
    assert list(drive.observe().readings) == ["pickup", "ball_9_angle"]
    kept = drive.snapshot()
    ahead = drive.advance(50).samples
    drive.restore(kept)
    assert drive.advance(50).samples.tobytes() == ahead.tobytes()


def test_a_bare_name_takes_the_defaults() -> None:
    bare, given = on_edge({"pickup": None}), on_edge({"pickup": {}})
    assert bare == given and given.sensors["pickup"].bandwidth == 100.0
    assert check_scene(bare.as_mapping(), "again") == bare
    assert load_scene("one-ball", ["sensors.pickup={}"]).sensors == bare.sensors
    assert not load_scene("on-edge", ["sensors.accelerometer="]).sensors


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"effects.accelerometer": {}}, "it does not act on the motion, so it is no effect; write"),
        ({"effects.accelerometer": {"seed": 3}}, "e.g. `sensors: {accelerometer: {bandwidth: 200"),
        ({"sensors.a.bandwith": 3}, "sensors.a.bandwith = 3: not known here"),
        ({"sensors.a.bandwith": 3}, "allowed here: position, axis_angle, range, noise_density, "),
        ({"sensors.a.stiffness": 3}, "a parameter of an effect: effects.suspension.stiffness"),
        ({"rotor.bandwidth": 3}, "not known here, it is a parameter of a sensor: sensors.NAME.ban"),
        ({"rotor.axis_angle": 3}, "an effect: effects.unequal_suspension.axis_angle or a sensor: "),
        ({"sensors.a.range": 0}, "sensors.a.range = 0: must be more than 0;"),
        ({"sensors.a.range": "far"}, "sensors.a.range = 'far': must be a number, in m/s^2 or with"),
        ({"sensors.a.seed": 1.5}, "sensors.a.seed = 1.5: must be a whole number;"),
        ({"sensors.a": 3}, "sensors.a = 3: must be a section"),
        ({"sensors": ["accelerometer"]}, "sensors = ['accelerometer']: must be a section `name: "),
        ({"sensors.Deck left": {}}, "sensors.Deck left = 'Deck left': the name must have at"),
        ({"sensors": {5: {}}}, "sensors.5 = 5: the name must have at most 64 small letters, "),
        ({"sensors.a.sample_rate": 300.0}, "sensors.a.sample_rate = 300 Hz: must be the integrat"),
    ],
)
def test_bad_input_is_named(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError) as caught:
        changed_scene(load_scene("thesis-hold"), changes, "test")
    assert words in str(caught.value)


def test_sensors_with_one_seed_have_noise_of_their_own() -> None:
    """The first one's is that of a sensor alone."""
    noisy = {**CLEAN, "noise_density": 0.01}
    clean, alone = (read(run(on_edge({"pickup": each}))) for each in (CLEAN, noisy))
    both = run(on_edge({"pickup": noisy, "other": noisy}))
    assert read(both).tobytes() == alone.tobytes()
    first, second = (read(both, name).real - clean.real for name in ("pickup", "other"))
    assert abs(np.corrcoef(first, second)[0, 1]) < 0.3
