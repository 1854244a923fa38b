"""What an accuracy costs: whether the study's errors are true. Nothing here asserts a time."""

import io
import json
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.text import Annotation, Text
from rich.console import Console

from ab_sim.analysis.accuracy_cost import (
    AccuracyCost,
    ErrorBound,
    SettingCost,
    accuracy_cost,
)
from ab_sim.analysis.accuracy_cost import study as study_module
from ab_sim.analysis.accuracy_cost.methods import OwnStepper
from ab_sim.analysis.accuracy_cost.mujoco_peer import MuJoCo, mujoco_refusal
from ab_sim.analysis.accuracy_cost.problem import (
    LADDER,
    RightHandSide,
    energy_balance_refusal,
    sampling_of,
)
from ab_sim.analysis.accuracy_cost.reference import event_reference, gauss_nodes, smooth_reference
from ab_sim.analysis.accuracy_cost.study import all_families
from ab_sim.base.errors import InputError, SceneError
from ab_sim.cli.costs import accuracy_shown
from ab_sim.drive import Drive
from ab_sim.drive.accuracy.trials import Samples, deviation
from ab_sim.engine.integrate.registry import stepper_named, steppers
from ab_sim.scene import check_scene, load_scene
from ab_sim.scene.load import with_solver
from ab_sim.show.costs import drawn_accuracy
from ab_sim.show.saved import save
from tests.conftest import THESIS, merge
from tests.reference import simulate
from tests.reference.cases import oracle_cases
from tests.reference.of_scene import params_of
from tests.show.collisions import overlaps

ROUNDING = 1e-15
STEPS = (0.2e-3, 0.5e-3, 1e-3, 2e-3, 2.5e-3, 5e-3)
TOLERANCES = (1e-5, 1e-9)
SMOOTH: dict[str, Any] = {
    "start": {"speed": 80.0, "ball_angles": [0.3, -2.0]},
    # The hold begins and ends off every grid.
    "profile": {
        "variable_speed_period": {"start_time": 0.1037, "duration": 0.1, "acceleration": 0.0},
        **THESIS["profile"],
    },
    "duration": 0.4,
}
FRICTION = {"effects": {"rolling_friction": {"arm": 1e-6}}}


def made(**changes: Any) -> Any:
    return check_scene(merge(THESIS, changes), "test")


@pytest.mark.parametrize("count", range(1, 9))
def test_the_references_nodes_integrate_polynomials_exactly(count: int) -> None:
    """Degree m - 1 up to every node, 2 m - 1 over the step, to rounding: the page rests on it."""
    c, a, b = gauss_nodes(count)
    for degree in range(count):
        assert np.abs(a @ c**degree - c ** (degree + 1) / (degree + 1)).max() < ROUNDING
    for degree in range(2 * count):
        assert abs(b @ c**degree - 1 / (degree + 1)) < ROUNDING
    assert abs(b @ c ** (2 * count) - 1 / (2 * count + 1)) > 1e-10, "and no further"


@lru_cache
def study() -> AccuracyCost:
    return accuracy_cost(made(**SMOOTH), repeats=1, steps=STEPS, tolerances=TOLERANCES)


def rows_of(method: str) -> list[SettingCost]:
    return sorted(
        (row for row in study().rows if row.method == method and row.errors),
        key=lambda row: row.step or row.tolerance or 0.0,
    )


def order(rows: list[SettingCost], least: float = 0.0) -> float:
    """Slope of log error in whirl over log step, where the error is more than rounding."""
    pairs = [
        (row.step, row.errors.whirl.value)
        for row in rows
        if row.errors and row.step and row.errors.whirl.value > least
    ]
    assert len(pairs) >= 2, pairs
    return float(np.polyfit(*np.log(np.array(pairs)).T, 1)[0])


OF_THEIR_OWN = ("taylor",)
"""They choose their own steps; those of the study are only how often they show a sample."""


@pytest.mark.parametrize("name", OF_THEIR_OWN)
def test_the_error_of_its_own_steps_is_that_of_its_tolerance(name: str) -> None:
    """1e-11 rad for each of some hundred steps, of which most is forgotten."""
    rows = rows_of(name)
    assert len(rows) >= 3
    assert all(row.errors and row.errors.angle.value < 20 * 1e-11 for row in rows)


@pytest.mark.parametrize("name", [name for name in steppers() if name not in OF_THEIR_OWN])
def test_errors_fall_with_the_declared_order(name: str) -> None:
    assert order(rows_of(name), 1e-11) == pytest.approx(stepper_named(name).order, abs=0.7)


def test_steps_beyond_the_stability_limit_are_named_as_refused() -> None:
    told = {each.method: each.reason for each in study().omitted}
    assert "stability limit" in told["rk4 at 5 ms"] and "at most" in told["rk4 at 5 ms"]


@pytest.mark.parametrize("name", ["DOP853", "LSODA", "Radau", "CVODE Adams", "CVODE BDF"])
def test_peers_are_as_accurate_as_their_tolerance_lets_one_expect(name: str) -> None:
    rows = rows_of(name)
    assert len(rows) >= 2
    for row in rows:
        assert row.errors is not None and row.tolerance is not None and row.peer
        assert row.errors.angle.value < 1e3 * row.tolerance + 1e-13
        assert row.evaluations is not None and row.evaluations > 100
    errors = [row.errors.angle.value for row in rows if row.errors]
    assert errors == sorted(errors)


def test_mujocos_model_is_the_scene() -> None:
    """It converges to the reference, with its order, across breakpoints that are off its grid."""
    rows = rows_of(MuJoCo.name)
    assert order(rows[:4]) == pytest.approx(4.0, abs=0.3)
    assert rows[0].errors is not None and rows[0].errors.angle.value < 1e-7


@pytest.mark.parametrize(
    "changes",
    [
        {"effects": {"ball_spin": None}, "balls": {"radius": None}},
        {"balls": {"mass": [1e-3, 2e-3]}, "rotor": {"eccentric_mass": 0.05}},
        {"start": {"angle": 0.7}, "balls": {"count": 3}},
    ],
    ids=["no ball spin", "masses that differ", "three balls"],
)
def test_mujocos_model_is_other_scenes_too(changes: Any) -> None:
    start = {"start": {"ball_angles": [0.3, -2.0, 2.0][: changes["balls"].get("count", 2)]}}
    scene = made(**merge(merge(SMOOTH, {**start, "duration": 0.12}), changes))
    sampling = sampling_of(scene)
    peer = MuJoCo(scene, sampling, 0.1e-3)
    peer.prepare()
    assert _apart(scene, peer.samples(peer.run()), 1e-10) < 1e-7


def test_mujoco_starts_as_the_scene_does() -> None:
    """Deck and balls displaced and moving; against rk8, which other tests hold to the reference."""
    start = {
        "ball_angles": [0.3, -2.0],
        "ball_rates": [3.0, -2.0],
        "deck": {"position": [1e-4, -5e-5], "velocity": [0.01, 0.02]},
    }
    scene = made(**merge(SMOOTH, {"start": start, "duration": 0.12}))
    sampling = sampling_of(scene)
    peer, own = MuJoCo(scene, sampling, 0.1e-3), OwnStepper(scene, sampling, "rk8", 0.5e-3)
    peer.prepare()
    unit = scene.whirl_unit[0]
    found = deviation(peer.samples(peer.run()), Samples.of(own.drive.advance(240)), unit)
    assert max(found.angle, 1e-3 * found.whirl) < 1e-7


def _apart(scene: Any, samples: Samples, rtol: float) -> float:
    """Largest difference in ball angle [rad] and whirl [1000 e] from the independent simulator."""
    times = sampling_of(scene).times
    other = simulate(params_of(scene), scene.start.ball_angles, times, rtol=rtol)
    want = Samples(np.column_stack([other.x, other.y]), other.theta)
    found = deviation(samples, want, scene.whirl_unit[0])
    return max(found.angle, 1e-3 * found.whirl)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"effects": {"gravity": {"tilt": 1.0}}}, "lacks gravity"),
        ({"effects": {"spindle_acceleration": None}}, "spindle_acceleration"),
        (
            {
                "profile": {
                    "kind": "speed_change", "start_time": 0.1, "duration": 0.1, "to_speed": 100.0,
                }
            },
            "constant accelerations",
        ),
    ],
)  # fmt: skip
def test_what_mujoco_cannot_represent_is_said(changes: Any, words: str) -> None:
    scene = made(**changes)
    assert words in mujoco_refusal(scene)
    with pytest.raises(SceneError, match="cannot represent"):
        MuJoCo(scene, sampling_of(scene), 1e-3)


def test_mujocos_deck_moves_in_the_plane() -> None:
    assert "a deck in the plane" in mujoco_refusal(load_scene("feeding-deck"))


def test_the_reference_meets_the_oracle() -> None:
    """P03: two other integrations of other forms of the equations, good to about 1e-12."""
    case = oracle_cases()["P03"]
    scene = made(duration=1.0, start={"ball_angles": case["theta0_rad"]})
    reference = smooth_reference(RightHandSide(scene, sampling_of(scene)))
    expected = case["expected"]["1.0"]
    assert np.abs(reference.first.angles[-1] - expected["theta"]).max() < 1e-12
    assert np.abs(reference.first.position[-1] - [expected["x"], expected["y"]]).max() < 1e-15
    assert reference.uncertainty.angle < 1e-13


def test_the_reference_meets_the_independent_simulator() -> None:
    """Whose equations, frame, and solution share nothing with it; that one's errors dominate."""
    scene = made(**merge(SMOOTH, {"duration": 0.2}))
    reference = smooth_reference(RightHandSide(scene, sampling_of(scene)))
    assert _apart(scene, reference.first, 1e-12) < 1e-11


def test_errors_below_the_uncertainty_are_bounds() -> None:
    assert str(ErrorBound.of(1e-15, 3e-13)) == "<= 3.0e-13"
    assert str(ErrorBound.of(2e-9, 3e-13)) == "2.0e-09"
    for row in study().rows:
        assert row.failure or (row.errors and row.errors.angle.value >= study().uncertainty.angle)


def test_energy_errors_fall_with_the_motions() -> None:
    for name in ("rk8", "DOP853", "CVODE Adams"):
        rows = rows_of(name)
        fine, coarse = rows[0].errors, rows[-1].errors
        assert fine and coarse and fine.energy is not None and coarse.energy is not None
        assert fine.energy < 1e-8 and fine.energy <= coarse.energy
    assert all(row.errors and row.errors.energy is None for row in rows_of(MuJoCo.name))


def test_without_spindle_acceleration_there_is_no_energy_balance() -> None:
    assert "energy balance" in energy_balance_refusal(made(effects={"spindle_acceleration": None}))
    assert energy_balance_refusal(made()) == ""


def test_the_cheapest_setting_for_an_error() -> None:
    row = study().cheapest(1e-6, peer=False)
    assert row is not None and row.errors is not None and not row.peer
    assert row.errors.angle.value <= 1e-6
    assert study().cheapest(1e-30) is None
    front = study().front()
    times = [row.cpu.median for row in front if row.cpu]
    assert times == sorted(times, reverse=True)


def test_events_are_left_to_the_package_and_the_others_are_named() -> None:
    scene = made(**FRICTION)
    _, missing = all_families(scene, sampling_of(scene), None, True, LADDER, TOLERANCES)
    told = {each.method: each.reason for each in missing}
    assert set(told) == {"DOP853", "LSODA", "Radau", "CVODE", MuJoCo.name}
    assert "rolling_friction" in told["CVODE"] and "first order" in told["CVODE"]


def test_the_reference_of_a_scene_with_events_is_another_steppers() -> None:
    scene = made(**merge(FRICTION, {"duration": 0.1, "start": {"ball_angles": [0.3, -2.0]}}))
    sampling = sampling_of(scene)
    reference = event_reference(scene, sampling)
    assert "cross-checked by tsit5" in reference.text
    assert {"steppers", "location of events"} <= set(reference.shares)
    assert reference.samples_for("rk8") is reference.second
    assert reference.samples_for("rk4") is reference.first
    run = OwnStepper(scene, sampling, "rk8", 1e-3)
    found = deviation(run.samples(run.run()), reference.samples_for("rk8"), scene.whirl_unit[0])
    assert run.events > 0
    assert found.angle < 1e-10 and reference.uncertainty.angle < 1e-11


def test_a_reference_with_events_has_samples_wherever_steps_end() -> None:
    changes = {"duration": 0.1, "solver": {"step": 1.25e-3}}
    scene = made(**merge(FRICTION, changes))
    sampling = sampling_of(scene)
    reference = event_reference(scene, sampling)
    number = sampling.number * sampling.parts
    assert number * 1.25e-3 > 4 * sampling.end, "closer than the scene's steps"
    assert len(reference.first.position) == len(reference.second.position) == number


def test_what_is_not_independent_is_said_to_be_so() -> None:
    """In JSON and in print; the numbers are another study's."""
    scene = made(**merge(FRICTION, {"duration": 0.1}))
    reference = event_reference(scene, sampling_of(scene))
    ours = replace(study(), reference=reference.text, reference_shares=reference.shares)
    assert ours.report()["reference_independent"] is False
    for accuracy, words in (
        (study(), "it is independent: with ab_sim's steppers, it shares only the equations"),
        (ours, "it is not independent: with ab_sim's steppers, it shares the equations of motion, "
         "laws of friction and contact, steppers, location of events"),
    ):  # fmt: skip
        console = Console(file=io.StringIO(), width=1000)
        console.print(*accuracy_shown(accuracy), sep="\n")
        assert words in console.file.getvalue()  # type: ignore[attr-defined]


def test_missing_peers_are_named_with_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent() -> Any:
        raise ImportError

    monkeypatch.setattr(study_module, "cvode_solvers", absent)
    monkeypatch.setattr(study_module.importlib.util, "find_spec", lambda name: None)
    scene = made(**SMOOTH)
    sampling = sampling_of(scene)
    found, missing = all_families(
        scene, sampling, RightHandSide(scene, sampling), True, LADDER, TOLERANCES
    )
    assert [name for name, _ in found] == [*steppers(), "DOP853", "LSODA", "Radau"]
    told = {each.method: each.reason for each in missing}
    assert "ab_sim[peers]" in told["CVODE"] and "ab_sim[peers]" in told[MuJoCo.name]


def test_stiff_drag_gets_steps_below_the_ladder() -> None:
    stiff = {"viscous_drag": {"coefficient": 100.0}}
    scene = made(effects=stiff, solver={"stepper": "imex8"})
    found, _ = all_families(scene, sampling_of(scene), None, True, LADDER, ())
    settings = {name: [what for what, _ in each] for name, each in found}
    assert settings["rk8"][-3:] == ["0.05 ms", "0.02 ms", "0.01 ms"]
    assert settings["generalized-alpha"][-1] == "0.1 ms", "which drag does not limit"


def test_samples_fall_on_steps_and_on_whole_periods() -> None:
    at = sampling_of(made(duration=1.2345))
    assert (at.period, at.number) == (0.01, 123)
    assert all(at.per_period(step) for step in LADDER)
    assert at.parts == 20 and at.finest.number == 2460
    own = sampling_of(made(solver={"step": 3.75e-3}))
    assert own.period == 0.03 and own.per_period(3.75e-3) == 8 and own.parts == 120
    assert sampling_of(made(duration=0.02)).period == 0.001
    # A long run is compared at fewer instants, at long steps' own first.
    assert sampling_of(made(duration=400.0)).parts == 4


@pytest.mark.parametrize("step", [5e-3, 2.5e-3])
def test_errors_are_the_largest_at_any_step(step: float) -> None:
    """They peak just after the spindle's acceleration jumps, between coarse samples."""
    (row,) = (row for row in rows_of("rk8") if row.step == step)
    runs = []
    for each in (step, 0.25e-3):
        drive = Drive(with_solver(made(**SMOOTH), "rk8", each))
        runs.append(Samples.of(drive.advance(round(0.4 / each))))
    found = deviation(*runs, drive.scene.whirl_unit[0])
    assert row.errors is not None
    assert row.errors.angle.value == pytest.approx(found.angle, rel=0.01, abs=1e-13)
    assert row.errors.whirl.value == pytest.approx(found.whirl, rel=0.01, abs=1e-13)


def test_the_report_survives_json_and_makes_a_picture(tmp_path: Path) -> None:
    report = json.loads(json.dumps(study().report(), allow_nan=False))
    assert {"date", "machine", "versions", "reference", "uncertainty", "rows"} <= set(report)
    assert {"scipy", "scikit-sundae", "mujoco"} <= set(report["versions"])
    assert report["reference_shares"] == ["equations of motion"]
    assert report["reference_independent"] is True
    row = report["rows"][0]
    assert row["errors"]["angle"].keys() == {"value", "at_most"}
    assert row["cpu"]["lower"] <= row["cpu"]["median"] <= row["cpu"]["upper"]
    save(drawn_accuracy(study()), tmp_path / "a.svg", 120)
    assert "<svg" in (tmp_path / "a.svg").read_text()


def test_a_settings_label_is_drawn_where_it_covers_no_mark() -> None:
    """The label of "1 ms" is left of its mark, in the picture of a cost with chosen times."""
    costs = {("rk8", 5e-3): (1e-5, 1e-4), ("rk8", 1e-3): (1e-4, 1e-8)}
    beside = {("tsit5", 2e-3): (4.5e-5, 1.2e-8)}
    for chosen, texts in ((costs, {"5 ms", "1 ms"}), (costs | beside, {"5 ms", "2 ms"})):
        rows = []
        for row in study().rows:
            place = chosen.get((row.method, row.step or 0.0))
            if place is not None and row.cpu and row.errors:
                cpu = row.cpu._replace(median=place[0])
                bound = row.errors.angle._replace(value=place[1], at_most=False)
                errors = row.errors._replace(angle=bound, whirl=bound)
                rows.append(row._replace(cpu=cpu, errors=errors))
        assert len(rows) == len(chosen)
        figure = drawn_accuracy(replace(study(), rows=tuple(rows)))
        figure.draw_without_rendering()
        for axes in figure.axes:
            notes = [text for text in axes.texts if isinstance(text, Annotation)]
            assert {note.get_text() for note in notes} == texts
            boxes = [(note.get_text(), Text.get_window_extent(note)) for note in notes]
            assert not list(overlaps(boxes))
            lines = [line for line in axes.lines if "ab_sim" in str(line.get_label())]
            marks = np.vstack([axes.transData.transform(line.get_xydata()) for line in lines])
            assert len(marks) == len(chosen)
            for _, box in boxes:
                assert axes.bbox.x0 <= box.x0 and box.x1 <= axes.bbox.x1
                assert not any(box.contains(*mark) for mark in marks)


def test_bad_input_is_refused() -> None:
    with pytest.raises(InputError, match="at least 1"):
        accuracy_cost(made(), repeats=0)
    with pytest.raises(InputError, match="too short"):
        accuracy_cost(made(duration=0.001))
    with pytest.raises(SceneError, match="solver.step = 0.1 s: "):
        accuracy_cost(made(solver={"step": 0.1}))
