"""Derivatives of merits and readings, and what has none."""

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from ab_sim.analysis.sensitivity import NoDerivative
from ab_sim.analysis.sensitivity.keys import moved

import ab_sim
from ab_sim.analysis.merits import merit as registry
from ab_sim.errors import InputError, SceneError
from ab_sim.scene.load import load_scene
from ab_sim.scene.model import Scene
from tests.analysis.sensitivity.differences import run_of

SCENE = load_scene(
    "thesis-hold", ["duration=0.3", "start.speed=80", "start.ball_angles=[0.3, 1.2]"]
)
KEYS = ["balls.mass", "rotor.eccentricity", "effects.suspension.damping"]
MERITS = ["final_whirl_over_e", "peak_whirl_over_e", "residual_unbalance", "final_speed",
          "vibration_velocity_rms", "slipped_turns_total", "balance_grade"]  # fmt: skip


def differences(
    scene: Scene, key: str, value: float, of: Callable[[Scene], np.ndarray]
) -> np.ndarray:
    step = 1e-4 * value
    one, two = (of(moved(scene, key, value + k * step)) - of(moved(scene, key, value - k * step))
                for k in (1, 2))  # fmt: skip
    return np.asarray((8.0 * one - two) / (12.0 * step))


def test_merits_change_as_those_of_other_runs() -> None:
    found = ab_sim.sensitivities(SCENE, KEYS)
    judged = found.of_merits(MERITS)

    def of(scene: Scene) -> np.ndarray:
        merits = ab_sim.merits_of(run_of(scene, 300), scene, MERITS)
        return np.array([merits[name] for name in MERITS])

    assert judged.merit_values == pytest.approx(of(SCENE), rel=1e-12)
    for k, key in enumerate(KEYS):
        by = differences(SCENE, key, float(found.values[k]), of)
        floor = 1e-6 * np.abs(judged.merit_values / found.values[k])
        assert (np.abs(judged.derivatives[:, k] - by) < 1e-6 * np.abs(by) + 1e-3 * floor).all(), key
    whirl, mass = judged.derivatives[0, 0], found.values[0]
    assert judged.elasticities[0, 0] == pytest.approx(whirl * mass / judged.merit_values[0])
    assert judged.unit(0, 0) == "e/kg" and judged.unit(0, 2) == "e/(N s/m)"
    assert judged.to_dataframe()["d final_whirl_over_e"][0] == whirl


def test_readings_change_as_those_of_other_runs() -> None:
    quiet = (
        "{noise_density: 0.0, resolution: 0.0, bandwidth: 50, sample_rate: 250, axis_angle: 0.3}"
    )
    scene = load_scene(
        "on-edge",
        [
            *("duration=0.06", "start.ball_angles=[0.4, -0.3]"),
            f"sensors.accelerometer={quiet}",
            "probes.gap={noise_density: 0.0, resolution: 0.0}",
        ],
    )
    channels, keys = (
        ["accelerometer_2", "x", "gap_1"],
        ["balls.mass", "effects.gravity.acceleration"],
    )
    times = [0.0, 0.02, 0.059]
    found = ab_sim.sensitivities(scene, keys, channels=channels, times=times)
    assert found.derivatives.shape == (3, 2, 3)
    assert found.times == pytest.approx(times, rel=1e-15)
    for k, key in enumerate(keys):
        by = differences(
            scene,
            key,
            float(found.values[k]),
            lambda there: np.array([run_of(there, 59)[name][[0, 20, 59]] for name in channels]),
        )
        assert found.derivatives[:, k] == pytest.approx(by, rel=1e-5, abs=1e-6 * np.abs(by).max())


@pytest.mark.parametrize(
    ("merit", "said"),
    [
        ("balanced", "is no number, and has no derivative"),
        ("start_up_time", "is the time of a sample, jumps from one to the next"),
        ("final_tilt", "has no value in this run"),
        ("final_whirl", "no such merit"),
    ],
)
def test_merits_without_a_derivative_are_refused(merit: str, said: str) -> None:
    found = ab_sim.sensitivities(load_scene("thesis-hold", ["duration=0.01"]), ["balls.mass"])
    with pytest.raises(InputError, match=said):
        found.of_merits([merit])


def test_merits_need_all_channels_and_steps() -> None:
    scene = load_scene("thesis-hold", ["duration=0.01"])
    for found in (
        ab_sim.sensitivities(scene, ["balls.mass"], channels=["x"]),
        ab_sim.sensitivities(scene, ["balls.mass"], times=[0.001, 0.01]),
    ):
        with pytest.raises(InputError, match="all channels at all steps"):
            found.of_merits(["final_speed"])


@pytest.fixture
def only_here() -> Iterator[None]:
    """What a test registers is forgotten after it."""
    before = dict(registry._merits)
    yield
    registry._merits.clear()
    registry._merits.update(before)


@pytest.mark.usefixtures("only_here")
def test_a_kink_is_seen() -> None:
    @ab_sim.register_merit("distance_of_x", meaning="has a kink at the run's own x")
    class Distance:
        own: float | None = None

        def __init__(self, scene: Scene, samples: int) -> None:
            self.x = 0.0

        def take(self, piece: ab_sim.Trajectory) -> None:
            self.x = float(piece["x"][-1])

        def value(self) -> float:
            Distance.own = self.x if Distance.own is None else Distance.own
            return abs(self.x - Distance.own)

    found = ab_sim.sensitivities(load_scene("thesis-hold", ["duration=0.05"]), ["balls.mass"])
    with pytest.raises(NoDerivative, match=r"'distance_of_x' by balls.mass: has a jump or a kink"):
        found.of_merits(["distance_of_x"])


def test_balls_that_rest_or_touch_together_have_no_derivative_apart() -> None:
    scene = load_scene(
        "on-edge", ["duration=0.7", "effects.ball_contact=", "start.ball_angles=[0, 0]"]
    )
    with pytest.raises(NoDerivative, match=r"ball \d comes to rest together") as refused:
        ab_sim.sensitivities(scene, ["balls.mass", "start.ball_angles.0"])
    assert refused.value.key == "start.ball_angles.0"
    assert ab_sim.sensitivities(scene, ["balls.mass"]).derivatives.shape == (13, 1, 701)
    packed = load_scene("packed-balls", ["duration=0.01"])
    with pytest.raises(NoDerivative, match="balls touch at the start") as refused:
        ab_sim.sensitivities(packed, ["start.ball_angles.3"])
    assert refused.value.key == "start.ball_angles.3"
    # All radii at once keep the row packed.
    assert np.isfinite(ab_sim.sensitivities(packed, ["balls.radius"]).derivatives).all()


def test_a_speed_that_measurements_decide_has_no_derivative() -> None:
    with pytest.raises(SceneError, match="a controller decides the speed while it runs"):
        ab_sim.sensitivities("adaptive-start-up", ["balls.mass"])


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"keys": []}, "must be a list of the scene's keys"),
        ({"keys": "balls.mass"}, "must be a list of the scene's keys"),
        ({"channels": ["z"]}, "channel 'z': there is none"),
        ({"times": [0.0015]}, "must be a whole number of steps of 0.001 s"),
        ({"times": [float("nan")]}, "must be a whole number of steps"),
        ({"times": [10**400]}, r"times: 1.00000e\+400 s: must be a whole number of steps"),
        ({"times": [-0.001]}, "must be a whole number of steps"),
        ({"times": [0.002, 0.001]}, "must rise"),
        ({"times": []}, "must rise, and be at least one"),
        ({"times": [1e9]}, "too many to keep"),
    ],
)
def test_bad_arguments_are_refused(arguments: dict[str, list[float]], said: str) -> None:
    with pytest.raises(InputError, match=said):
        ab_sim.sensitivities("thesis-hold", **{"keys": ["balls.mass"], **arguments})  # type: ignore[arg-type]


def test_a_result_says_what_it_is() -> None:
    found = ab_sim.sensitivities(load_scene("thesis-hold", ["duration=0.01"]), KEYS, channels=["x"])
    assert repr(found).startswith("<Sensitivities: scene thesis-hold, keys balls.mass, rotor.ecc")
    assert (found.of("x", "balls.mass") == found.derivatives[0, 0]).all()
    with pytest.raises(InputError, match="key 'balls.radius': there is none"):
        found.of("x", "balls.radius")
    start = ab_sim.sensitivities("thesis-hold", ["start.ball_angles.1"], times=[0.0])
    assert start.of("ball_1_angle", "start.ball_angles.1") == pytest.approx([1.0])
