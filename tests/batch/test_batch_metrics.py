"""Metrics of a batch against those of one Drive after the other; runs in columns against scenes."""

import math
from typing import Any

import numpy as np
import pytest

from ab_sim.analysis import run_scene
from ab_sim.analysis.metrics import metrics_of
from ab_sim.analysis.metrics.judging import RunNumbers
from ab_sim.analysis.metrics.metric import MetricKind, metrics_named, reported_metrics
from ab_sim.base.errors import InputError, SceneError
from ab_sim.design.batch import Batch, judging, run_columns, simulate_batch
from ab_sim.design.batch.lane_group import LaneStarts
from ab_sim.design.batch.prepared_run import PreparedRun
from ab_sim.design.batch.run_columns import columns_of
from ab_sim.design.batch.simulate import varied, varied_scene
from ab_sim.drive import Drive
from ab_sim.scene import Scene, load_scene

KEYS = [metric.key for metric in reported_metrics()]
ASK_SCENES = {
    "first_passage_of_opposite",
    "settling_period",
    "overlapping_balls",
    "vibration_velocity_rms",
    "vibration_velocity_peak",
    "vibration_velocity_null",
    "velocity_rms",
}
SPREAD = np.linspace(0.0, 1.0, 19)
COLUMNS: dict[str, np.ndarray] = {
    "balls.mass": 1e-3 * (1.0 + SPREAD),
    "effects.suspension.stiffness": 1000.0 + 300.0 * SPREAD**2,
    "effects.suspension.damping": 0.2 + 0.1 * np.cos(SPREAD),
    "effects.viscous_drag.coefficient": 1.0 + np.sin(9 * SPREAD) / 3,
    "rotor.eccentricity": 1e-4 * np.maximum(SPREAD, 0.1),
    "rotor.total_mass": 0.1 + 0.03 * SPREAD,
    "race.radius": 0.01 + 0.002 * SPREAD,
}
ANGLES = np.stack([0.3 - SPREAD, -4.0 + 9 * SPREAD], axis=1)


def short(scene: Any, **changes: Any) -> Scene:
    """The thesis' drive, started up in a fraction of a second."""
    profile = {"kind": "start_up", "acceleration": 400.0, "target_speed": 180.0}
    limits = {"max_acceleration": 1000.0}
    made = scene(**{"profile": profile, "spindle": limits, "duration": 0.6, **changes})
    assert isinstance(made, Scene)
    return made


def assert_judged_like_drives(
    base: Scene, variations: list[dict[str, Any]], **options: Any
) -> Batch:
    """Each run's metrics are those of its Drive, to the bit."""
    batch = simulate_batch(base, variations, metrics=KEYS, **options)
    assert set(batch.metrics) == set(KEYS) and len(batch) == len(variations)
    for run, scene in enumerate(varied(base, variations)):
        steps = math.ceil(scene.duration / scene.solver.step - 1e-9)
        expected = metrics_of(Drive(scene).advance(steps), scene, KEYS).report()
        assert batch.failures[run] == ""
        for metric in metrics_named(KEYS):
            value, wanted = batch.metrics[metric.key][run], expected[metric.key]
            if wanted is None and metric.kind is MetricKind.NUMBER:
                assert math.isnan(value), metric.key
            else:
                assert value == wanted, metric.key
    return batch


def rows(columns: dict[str, np.ndarray]) -> list[dict[str, Any]]:
    return [{key: column[k].tolist() for key, column in columns.items()} for k in range(19)]


@pytest.mark.parametrize("given", ["total_mass", "mass", "eccentric_mass"])
def test_runs_in_columns_are_their_drives_to_the_bit(scene: Any, given: str) -> None:
    columns, rotor = dict(COLUMNS), {}
    if given == "mass":
        rotor = {"total_mass": None, "mass": 0.098}
        columns["rotor.mass"] = columns.pop("rotor.total_mass")
    elif given == "eccentric_mass":
        rotor = {"eccentric_mass": 0.05}
        columns["rotor.eccentric_mass"] = 0.05 + 0.01 * SPREAD
        columns["start.ball_angles"] = ANGLES
    base = short(scene, rotor=rotor, start={"ball_angles": [0.3, -4.0]})
    by_column = columns_of(base, columns)
    assert by_column is not None and by_column.valid.tolist() == list(range(19))
    batch = assert_judged_like_drives(base, rows(columns))
    assert batch.in_lanes == 19 and batch.runs == ()
    same = simulate_batch(base, columns, metrics=KEYS)
    for key in KEYS:
        np.testing.assert_array_equal(same.metrics[key], batch.metrics[key])
    assert dict(same.variations[3]) == batch.variations[3]


@pytest.mark.parametrize("balls", [0, 1, 5])
def test_what_columns_prepare_is_what_scenes_give(scene: Any, balls: int) -> None:
    """Constants, starts and what metrics take from a scene, bit by bit."""
    masses = [1e-3 * (1 + i) for i in range(balls)]
    columns = {key: each for key, each in COLUMNS.items() if key != "balls.mass"}
    base = short(scene, balls={"count": balls, "mass": masses}, start={"speed": 3.0})
    if balls:
        columns["start.ball_angles"] = np.outer(SPREAD, 7.0 * np.arange(balls) - 3.0)
    by_column = columns_of(base, columns)
    assert by_column is not None and len(by_column.valid) == 19
    scenes = varied(base, rows(columns))
    prepared = [PreparedRun(each) for each in scenes]
    for ours, theirs in (
        (by_column.starts(by_column.valid), LaneStarts.of(prepared)),
        (by_column.judged(by_column.valid).numbers, RunNumbers.of(scenes)),
    ):
        for name in ours._fields:
            np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name), name)
    assert {run.group_key for run in prepared} == {by_column.first.group_key}
    assert {run.step_plan_key for run in prepared} == {by_column.first.step_plan_key}
    assert list(by_column.judged(by_column.valid).scenes) == scenes


def test_runs_in_columns_take_no_scenes_for_metrics_that_ask_for_none(
    scene: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    base, keys = short(scene), [key for key in KEYS if key not in ASK_SCENES]
    expected = simulate_batch(base, COLUMNS, metrics=keys)
    monkeypatch.setattr(run_columns, "changed_scene", None)
    found = simulate_batch(base, COLUMNS, metrics=keys)
    for key in keys:
        np.testing.assert_array_equal(found.metrics[key], expected.metrics[key])


@pytest.mark.parametrize(
    "bad",
    [
        {"balls.mass": -1.0},
        {"balls.mass": math.nan},
        {"balls.mass": True},
        {"balls.mass": 0.07},
        {"balls.mass": "heavy"},
        {"rotor.eccentricity": 1e-13},
        {"rotor.total_mass": 1e-3},
        {"effects.suspension.stiffness": math.inf},
        {"effects.viscous_drag.coefficient": 1e9},
        {"effects.suspension.damping": -1e-300},
        {"rotor.eccentricity": None},
        {"race.radius": 1e-3},
        {"start.ball_angles": [0.1]},
        {"start.ball_angles": [0.1, math.nan]},
        {"start.ball_angles": 0.1},
    ],
)
def test_a_run_that_is_refused_is_refused_with_its_scenes_own_words(scene: Any, bad: Any) -> None:
    base, variations = short(scene, solver={"stepper": "rk4"}), rows(COLUMNS)
    (key, value) = next(iter(bad.items()))
    variations[11] = {**variations[11], key: value}
    with pytest.raises(SceneError) as told:
        PreparedRun(varied_scene(base, variations[11], 11))
    with pytest.raises(SceneError) as found:
        simulate_batch(base, variations, metrics=KEYS[:1])
    assert str(told.value).removeprefix("variation 11: ") in str(found.value)
    assert str(found.value).startswith("variation 11: ")


def near(limit: float, rng: np.random.Generator) -> np.ndarray:
    """The limit, and random values on both sides of it, by 3e-16 to a factor of 3."""
    away = 10.0 ** rng.uniform(-15.5, 0.3, 60)
    return np.array([limit, *(limit * (1.0 + away)), *(limit / (1.0 + away))])


@pytest.mark.parametrize(
    ("key", "limits"),
    [
        ("rotor.eccentricity", (1e-12, 1.0)),
        ("rotor.total_mass", (2e-3, 0.052, 1e3)),
        ("rotor.eccentric_mass", (1e-9, 0.098)),
        ("balls.mass", (1e-12, 0.025, 0.05)),
        ("race.radius", (2e-3, 10.0)),
        ("start.ball_angles", (1e10,)),
        ("effects.suspension.stiffness", (7.8e5, 1e12)),
        ("effects.suspension.damping", (270.0, 1e9)),
        ("effects.viscous_drag.coefficient", (3.8, 1e6)),
    ],
)
def test_columns_take_the_values_that_scenes_take(
    scene: Any, key: str, limits: tuple[float, ...]
) -> None:
    """On both sides of each bound, of each condition between sections, and of stability."""
    rng = np.random.default_rng(7)
    changes = {"balls": {"radius": [1e-3, 2e-3]}, "rotor": {"eccentric_mass": 0.05}}
    base = short(scene, solver={"stepper": "rk4"}, **changes)
    one = np.concatenate([[0.0, -0.0, -1e-300, 1e-300], *(near(limit, rng) for limit in limits)])
    values = np.stack([one, one[::-1]], axis=1) if key == "start.ball_angles" else one
    by_column = columns_of(base, {key: values})
    assert by_column is not None
    in_columns, refused = set(by_column.valid.tolist()), {}
    for row, value in enumerate(values.tolist()):
        try:
            PreparedRun(varied_scene(base, {key: value}, row))
        except SceneError as error:
            refused[row] = str(error).removeprefix(f"variation {row}: ")
        else:
            if row not in in_columns:  # close to the stability limit
                with pytest.raises(SceneError, match="stability limit"):
                    PreparedRun(varied_scene(base, {key: value, "solver.step": 1.03e-3}, row))
    assert refused and in_columns and not in_columns & refused.keys()
    some = min(in_columns)
    for row in rng.permutation(list(refused))[:5].tolist():
        with pytest.raises(SceneError) as raised:
            simulate_batch(base, {key: values[[some, row]]}, metrics=KEYS[:1])
        assert str(raised.value) == f"variation 1: {refused[row]}"


def test_values_that_only_a_scene_can_check_go_beside_the_others(scene: Any) -> None:
    """Texts with units, whole numbers, a key that is not given, drag that needs another stepper."""
    variations = rows({key: COLUMNS[key] for key in ("balls.mass", "rotor.eccentricity")})
    variations[2]["balls.mass"] = "1.5 g"
    variations[3]["rotor.eccentricity"] = 0
    del variations[5]["balls.mass"]
    variations[7]["effects.viscous_drag.coefficient"] = 100.0
    variations[8]["balls.mass"] = [1e-3, 2e-3]
    variations[9]["start.speed"] = 20.0
    assert_judged_like_drives(short(scene, solver={"stepper": "auto"}), variations)


@pytest.mark.parametrize(
    "changes",
    [
        {"effects": {"rolling_friction": {"arm": 1e-6}}},
        {"effects": {"gravity": {"tilt": 1.2}}},
        {"sensors": {"pickup": {"noise_density": 1e-3}}},
        {"solver": {"stepper": "imex8", "step": 0.005}},
    ],
)
def test_other_scenes_are_judged_like_drives(scene: Any, changes: Any) -> None:
    variations: list[dict[str, Any]] = [{}, {"balls.mass": 0.0012}, {"start.speed": 9.0}]
    assert_judged_like_drives(short(scene, **changes), variations)


def test_how_many_are_in_memory_at_a_time_makes_no_difference(
    scene: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    base = short(scene)
    whole = simulate_batch(base, COLUMNS, metrics=KEYS)
    monkeypatch.setattr(judging, "SAMPLES_AT_ONCE", 1)
    seen: list[tuple[int, int]] = []
    parts = simulate_batch(base, COLUMNS, progress=lambda *what: seen.append(what), metrics=KEYS)
    assert seen == [(8, 19), (16, 19), (19, 19)]
    for key in KEYS:
        np.testing.assert_array_equal(parts.metrics[key], whole.metrics[key])


def test_a_run_that_diverges_has_no_metrics_and_leaves_the_others_alone(scene: Any) -> None:
    base = short(scene, start={"ball_angles": [0.3, -0.5], "speed": 99.0}, profile=None)
    columns = {
        "rotor.eccentricity": [1e-4, 0.9, 2e-4, 0.9],
        "effects.viscous_drag.coefficient": [1.0, 0.0, 1.0, 0.0],
    }
    by_column = columns_of(base, columns)
    assert by_column is not None and len(by_column.valid) == 4
    batch = simulate_batch(base, columns, metrics=["final_whirl_over_e", "settled"])
    kept = simulate_batch(base, columns, metrics=["final_whirl_over_e"], samples=True)
    assert [bool(failure) for failure in batch.failures] == [False, True, False, True]
    assert batch.failures == kept.failures
    assert "beyond all bounds at t = " in batch.failures[1] and "diverged 2" in repr(batch)
    assert np.isnan(batch.metrics["final_whirl_over_e"]).tolist() == [False, True, False, True]
    assert batch.metrics["settled"][1] is None
    np.testing.assert_array_equal(
        kept.metrics["final_whirl_over_e"], batch.metrics["final_whirl_over_e"]
    )
    all_bad = {key: [values[1]] * 3 for key, values in columns.items()}
    assert all(simulate_batch(base, all_bad, metrics=KEYS).failures)


def test_samples_are_kept_beside_metrics_if_asked_for(scene: Any) -> None:
    base, variations = short(scene), rows(COLUMNS)
    batch = assert_judged_like_drives(base, variations, samples=True, every=100)
    plain = simulate_batch(base, variations, every=100)
    for one, other in zip(batch.runs, plain.runs, strict=True):
        assert one.trajectory.samples.tobytes() == other.trajectory.samples.tobytes()
    assert plain.metrics == {} and len(plain) == 19


def test_what_is_asked_of_a_batch_is_checked(scene: Any) -> None:
    base = short(scene)
    with pytest.raises(InputError, match="every = 7: "):
        simulate_batch(base, [{}], 7, metrics=KEYS)
    with pytest.raises(InputError, match="metric 'peak_wirl': no such"):
        simulate_batch(base, [{}], metrics=["peak_wirl"])
    for uneven in ({"balls.mass": [1e-3], "rotor.eccentricity": []}, {"balls.mass": 1e-3}, {}):
        with pytest.raises(InputError, match="^variations = .*one mapping per run"):
            simulate_batch(base, uneven)
    batch = simulate_batch(base, [{}, {}], metrics=["final_whirl_over_e"])
    with pytest.raises(InputError, match="^batch: has no samples"):
        batch.plot()
    assert list(batch.to_dataframe()) == ["final_whirl_over_e", "failure"]


@pytest.mark.parametrize("samples", [False, True])
def test_an_aborted_run_has_the_metrics_of_a_single_one_and_is_told(samples: bool) -> None:
    """Its reading is beyond what the sensor can."""
    base = load_scene("adaptive-start-up", ["duration=2"])
    variations: list[dict[str, Any]] = [{"sensors.pick_up.range": end} for end in (1000.0, 0.5)]
    alone = run_scene(list(varied(base, variations))[1])
    batch = assert_judged_like_drives(base, variations, samples=samples)
    assert alone.aborted is not None and batch.aborted == ("", alone.aborted.text)
    assert "aborted 1" in repr(batch) and "diverged" not in repr(batch)
    assert batch.to_dataframe()["aborted"].tolist() == list(batch.aborted)
    if samples:
        last = batch.runs[0].trajectory.whirl[-1]
        assert f"W at the end {last:.4g} to {last:.4g} m" in repr(batch), "of the other one only"


def test_where_none_was_aborted_nothing_is_said_of_it(scene: Any) -> None:
    batch = simulate_batch(short(scene), [{}, {}], metrics=KEYS[:1])
    assert batch.aborted == ("", "") and "aborted" not in repr(batch)
