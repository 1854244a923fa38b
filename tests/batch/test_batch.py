"""Runs side by side against one Drive after the other."""

import math
from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

import numpy as np
import pytest

import ab_sim
from ab_sim.base.errors import DivergedError, InputError, SceneError
from ab_sim.design.batch import simulate_batch
from ab_sim.design.batch.simulate import varied
from ab_sim.drive import Drive
from ab_sim.model.equations.motion import DeckMotion
from ab_sim.scene import Scene
from ab_sim.scene.quantities import Count, Number, quantity
from ab_sim.scene.registry import register
from ab_sim.tracing import where

HOLD = {
    "kind": "start_up",
    "acceleration": 400.0,
    "target_speed": 180.0,
    "variable_speed_period": {"start_speed": 100.0, "duration": 0.05},
}
EVERYTHING_SMOOTH: dict[str, Any] = {
    "suspension": None,
    "unequal_suspension": {
        "stiffness_1": 1000.0,
        "stiffness_2": 1400.0,
        "damping_1": 0.2,
        "damping_2": 0.3,
        "axis_angle": 0.4,
    },
    "hardening_suspension": {"cubic_stiffness": 1e8},
    "gravity": {"tilt": 1.2, "direction": 0.7},
    "race_runout": {"offset_1": 3e-4, "offset_2": -2e-4, "lobe": 2e-4, "lobe_angle": 0.3},
}


def quick(scene: Any, **changes: Any) -> Scene:
    """The thesis' drive with a start-up of half a second."""
    made = scene(profile=HOLD, spindle={"max_acceleration": 1000.0}, duration=0.6, **changes)
    assert isinstance(made, Scene)
    return made


def assert_equal_to_drives(
    base: Scene, variations: list[dict[str, Any]], every: int = 1, in_lanes: int | None = None
) -> None:
    """Each run is its Drive's to the bit; all run in lanes unless said otherwise."""
    batch = simulate_batch(base, variations, every)
    assert len(batch.runs) == len(variations)
    assert batch.in_lanes == (len(variations) if in_lanes is None else in_lanes)
    for run, scene in zip(batch.runs, varied(base, variations), strict=True):
        assert run.failure == ""
        assert run.scene == scene
        alone = Drive(scene).advance(math.ceil(scene.duration / scene.solver.step - 1e-9))
        assert run.trajectory.channels == alone.channels
        expected = alone.samples[every - 1 :: every]
        assert run.trajectory.samples.tobytes() == expected.tobytes()


@pytest.mark.parametrize("stepper", ["rk8", "taylor"])
@pytest.mark.parametrize("balls", [0, 2])
def test_every_scalar_may_vary(scene: Any, balls: int, stepper: str) -> None:
    """Breakpoints fall anywhere within steps, and at other steps in every run."""
    angles, solver = [0.3 * i for i in range(balls)], {"stepper": stepper}
    base = quick(scene, balls={"count": balls}, start={"ball_angles": angles}, solver=solver)
    variations = [
        {
            "rotor.eccentricity": 1e-4 * (1 + 0.02 * i),
            "rotor.total_mass": 0.1 + 0.001 * i,
            "effects.suspension.stiffness": 1000.0 + 7 * i,
            "effects.suspension.damping": 0.2 + 0.01 * i,
            "effects.viscous_drag.coefficient": 1.0 + 0.03 * i,
            "race.radius": 0.01 + 1e-4 * i,
            "start.ball_angles": [angle + 0.05 * i for angle in angles],
            "profile.acceleration": 400.0 + 3.1 * i,
            "profile.variable_speed_period.duration": 0.05 + 0.00037 * i,
            "profile.target_speed": 180.0 - 0.7 * i,
        }
        for i in range(11)
    ]
    if balls:
        for i, variation in enumerate(variations):
            variation["balls.mass"] = 1e-3 * (1 + 0.03 * i)
    assert_equal_to_drives(base, variations)


@pytest.mark.parametrize("stepper", ["rk8", "taylor"])
def test_all_effects_that_are_smooth(scene: Any, stepper: str) -> None:
    sensors = {"pickup": {"noise_density": 1e-3}, "other": {"axis_angle": 1.0}}
    start, solver = {"ball_angles": [0.4, -0.7]}, {"stepper": stepper}
    base = quick(scene, effects=EVERYTHING_SMOOTH, sensors=sensors, start=start, solver=solver)
    variations: list[dict[str, Any]] = [
        {
            "effects.gravity.tilt": 0.3 * i,
            "effects.hardening_suspension.cubic_stiffness": 1e8 * i,
            "effects.unequal_suspension.axis_angle": 0.1 * i,
            "effects.race_runout.lobe_angle": 0.2 * i,
            "sensors.pickup.seed": i,
        }
        for i in range(3)
    ]
    assert_equal_to_drives(base, variations)
    assert_equal_to_drives(base, variations[:1], every=7)


@pytest.mark.parametrize("stepper", ["rk8", "taylor"])
def test_a_raised_cosine_beside_ramps(scene: Any, stepper: str) -> None:
    change = {"kind": "speed_change", "start_time": 0.1, "duration": 0.2, "to_speed": 130.0}
    solver = {"stepper": stepper}
    base = scene(start={"speed": 90.0}, profile=change, duration=0.4, solver=solver)
    variations: list[dict[str, Any]]
    variations = [{"profile.start_time": 0.05 + 0.0203 * i} for i in range(9)]
    variations[3]["profile.duration"] = 1e-4  # in more parts than a step of the others
    assert_equal_to_drives(base, variations)


def test_runs_that_differ_in_more_than_numbers_find_their_like(scene: Any) -> None:
    base = quick(scene)
    variations: list[dict[str, Any]] = [
        {},
        {"solver.step": 0.0005},
        {"balls.count": 0, "start.ball_angles": None},
        {"duration": 0.3},
        {"solver.stepper": "rk4"},
    ]
    assert_equal_to_drives(base, variations)


class Magnets(NamedTuple):
    """As many springs as are counted, of one kind or the other."""

    stiffness: Annotated[Number, quantity("k", "N/m")]
    number: Annotated[Count, quantity("how many", "1")] = 1
    twisted: Annotated[bool, quantity("whether they pull across", "1")] = False

    def deck_force(self, deck: DeckMotion) -> tuple[float, float]:
        k = self.stiffness * self.number
        return (k * deck.y, -k * deck.x) if self.twisted else (-k * deck.x, -k * deck.y)


class Bumper(NamedTuple):
    """A spring that the deck meets behind a gap."""

    gap: Annotated[Number, quantity("to the spring", "m")]

    def space_force(self, deck: DeckMotion) -> tuple[float, float]:
        return (where(deck.x > self.gap, -300.0 * (deck.x - self.gap), 0.0), 0.0)


@pytest.fixture
def more_effects() -> Iterator[None]:
    with ab_sim.temporary_registrations():
        for name, effect in (("magnets", Magnets), ("bumper", Bumper)):
            register(name, equation="f = -k u", source="this test")(effect)
        yield


def test_counts_and_choices_of_effects_may_vary(scene: Any, more_effects: None) -> None:
    base = quick(scene, balls={"count": 0}, effects={"magnets": {"stiffness": 100.0}})
    variations: list[dict[str, Any]] = [
        {},
        {"effects.magnets.number": 3},
        {"effects.magnets.twisted": True, "effects.magnets.stiffness": 10.0},
        {"effects.magnets.number": 3, "effects.magnets.stiffness": 50.0},
        {"effects.magnets.number": 0},
    ]
    assert_equal_to_drives(base, variations)


def test_an_effect_that_branches_on_its_numbers_goes_side_by_side(
    scene: Any, more_effects: None
) -> None:
    base = quick(scene, balls={"count": 0}, effects={"bumper": {"gap": 1e-5}})
    variations = [{}, {"effects.bumper.gap": 1.0}]
    assert_equal_to_drives(base, variations)
    met, alone = (run.trajectory for run in simulate_batch(base, variations).runs)
    assert np.abs(met["x"] - alone["x"]).max() > 1e-6, "it was met"


def test_what_runs_alone_in_its_lanes_is_no_run_side_by_side(scene: Any) -> None:
    """A lone run, and one of each of two groups."""
    for variations in ([{}], [{}, {"effects.viscous_drag": None}]):
        batch = simulate_batch(quick(scene), variations)
        assert f"in lanes {len(variations)}, " in repr(batch) and "side by side" not in repr(batch)


def test_steppers_without_lanes_run_one_by_one_and_exactly(scene: Any) -> None:
    base = quick(scene, solver={"stepper": "generalized-alpha"})
    batch = simulate_batch(base, [{}, {"balls.mass": 0.002}, {"solver.parameters.rho_inf": 0.5}])
    assert batch.in_lanes == 0
    for run in batch.runs:
        alone = Drive(run.scene).advance(600)
        np.testing.assert_array_equal(run.trajectory.samples, alone.samples)


def test_runs_without_lanes_report_progress_one_by_one(scene: Any) -> None:
    seen: list[tuple[int, int]] = []
    base = quick(scene, solver={"stepper": "generalized-alpha"})
    simulate_batch(base, [{}, {}, {}], progress=lambda *what: seen.append(what))
    assert seen == [(1, 3), (2, 3), (3, 3)]


def test_an_accelerometer_takes_every_step_whatever_it_runs_beside(scene: Any) -> None:
    silent = {"sensors.pickup": {"noise_density": 0.0}}
    assert_equal_to_drives(quick(scene), [{}, silent], every=10)


def test_start_up_beside_speed_change(scene: Any) -> None:
    change = {"kind": "speed_change", "start_time": 0.1, "duration": 0.2, "to_speed": 130.0}
    assert_equal_to_drives(quick(scene), [{}, {"profile": change}, {"profile": None}])


@pytest.mark.parametrize("every", [1, 7])
def test_a_run_by_itself_keeps_what_was_sound(scene: Any, every: int) -> None:
    apart = {"ball_angles": [0.3, -0.5]}
    base = quick(scene, start=apart, solver={"stepper": "generalized-alpha"})
    # At resonance without damping.
    wild = {"rotor.eccentricity": 0.5, "profile": None, "start.speed": 99.9}
    wild |= {"effects.suspension.damping": 0.0, "effects.viscous_drag.coefficient": 0.0}
    (run,) = simulate_batch(base, [wild], every).runs
    assert "beyond all bounds" in run.failure
    drive = Drive(run.scene)
    with pytest.raises(DivergedError):
        drive.advance(600)
    sound = drive.steps
    assert 10 < sound < 600
    drive.reset()
    assert run.trajectory.samples.tobytes() == drive.advance(sound, every).samples.tobytes()


def test_keys_go_and_an_accuracy_may_be_asked_for(scene: Any) -> None:
    base = quick(scene)
    without = {"effects.ball_spin": None, "balls.radius": None}
    runs = simulate_batch(base, [without, {"accuracy.angle": 1e-6}]).runs
    assert "ball_spin" not in runs[0].scene.effects
    assert runs[1].scene.accuracy is None and runs[1].trajectory["time"][-1] >= 0.6


def test_one_run_that_diverges_leaves_the_others_alone(scene: Any) -> None:
    base = quick(scene, start={"ball_angles": [0.3, -0.5]})
    wild = {"rotor.eccentricity": 0.9, "effects.viscous_drag.coefficient": 0.0, "start.speed": 99.0}
    batch = simulate_batch(base, [{}, wild, {"balls.mass": 0.002}])
    assert batch.in_lanes == 3
    assert [bool(run.failure) for run in batch.runs] == [False, True, False]
    bad = batch.runs[1]
    assert "beyond all bounds at t = " in bad.failure
    assert 0 < len(bad.trajectory) < 600
    assert np.isfinite(bad.trajectory.samples).all()
    for run in (batch.runs[0], batch.runs[2]):
        np.testing.assert_allclose(
            run.trajectory.ball_angles, Drive(run.scene).advance(600).ball_angles, atol=1e-10
        )


def test_order_of_results_counts_and_progress(scene: Any) -> None:
    seen: list[tuple[int, int]] = []
    variations = [{"balls.mass": 1e-3 + 1e-5 * i} for i in range(19)]
    batch = simulate_batch(quick(scene), variations, 100, progress=lambda *what: seen.append(what))
    assert [run.scene.balls.mass for run in batch.runs] == [v["balls.mass"] for v in variations]
    assert batch.in_lanes == 19
    assert seen == [(8, 19), (16, 19), (19, 19)]
    assert all(len(run.trajectory) == 6 for run in batch.runs)
    assert batch.runs[0].trajectory["step"].tolist() == [100, 200, 300, 400, 500, 600]
    assert batch.integration_seconds > 0.0


@pytest.mark.parametrize(
    ("variations", "every", "error", "says"),
    [
        ([], 1, InputError, "one mapping per run"),
        ([{}], 0, InputError, "every = 0: .* at least 1"),
        pytest.param([{}], 10**5000, InputError, "every = <int .*at most 600", id="large"),
        ([{}], 601, InputError, "every = 601: .* at most 600"),
        ([{}], 2.5, InputError, "every = 2.5: .*whole number"),
        ({"balls.mass": 1.0}, 1, InputError, "one mapping per run"),
        ([["balls.mass"]], 1, SceneError, "variation 0 = .*mapping of dotted keys"),
        ([{1: 2}], 1, SceneError, "variation 0 = .*mapping of dotted keys"),
        ([{}, {"balls.mas": 1.0}], 1, SceneError, "variation 1: balls.mas.*mass"),
        ([{}] * 731 + [{"race.radius": -1.0}], 1, SceneError, "variation 731: race.radius = -1.0"),
        ([{}, {"race.radius": 1e-4}], 1, SceneError, "variation 1: balls.radius = .*race.radius"),
        ([{}, {"solver.step": 0.5}], 1, SceneError, "variation 1: solver.step = 0.5 s: "),
        ([{"balls.mass": float("nan")}], 1, SceneError, "variation 0: balls.mass"),
        ([{"duration.long": 1.0}], 1, SceneError, "duration is a value"),
        ([{"duration": 9e5, "solver.step": 1e-6}], 1, InputError, "would need memory for"),
    ],
)
def test_bad_input_is_told_before_anything_runs(
    scene: Any, variations: Any, every: Any, error: type[Exception], says: str
) -> None:
    with pytest.raises(error, match=says):
        simulate_batch(quick(scene), variations, every)
