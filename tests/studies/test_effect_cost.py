"""What effects cost: which variants are measured, that all numbers are there, and the cache.

Nothing here asserts a time: machines that run tests are busy.
"""

import json
from pathlib import Path
from typing import Any

import pytest

from ab_sim.analysis.effect_cost import ALL, BASE, effect_cost, off_axis, variants
from ab_sim.base.errors import InputError, SceneError
from ab_sim.scene import load_scene
from ab_sim.show.costs import drawn_cost
from ab_sim.show.saved import save

MOTOR = {"rotor_inertia": 2.9e-5, "torque_limit": 5e-3, "proportional_gain": 1e-3}


def test_variants_none_each_alone_and_the_set(scene: Any) -> None:
    made = scene()
    found = variants(made)
    assert [variant.name for variant in found] == [BASE, *made.effects, ALL]
    assert found[0].scene.effects == {}
    for variant in found[1:-1]:
        assert variant.scene.effects == {variant.name: made.effects[variant.name]}
        assert variant.added == ()
    assert found[-1].scene.effects == made.effects


def test_sensors_count_as_effects_do(scene: Any) -> None:
    made = scene(sensors={"left": {}, "right": {"seed": 1}})
    found = {variant.name: variant.scene for variant in variants(made, leave_one_out=True)}
    assert not found[BASE].sensors and not found["ball_spin"].sensors
    alone = found["sensor right"]
    assert not alone.effects and alone.sensors == {"right": made.sensors["right"]}
    assert found[ALL].sensors == made.sensors == found["all but ball_spin"].sensors
    without = found["all but sensor right"]
    assert without.effects == made.effects and list(without.sensors) == ["left"]


def test_an_effect_that_is_refused_alone_brings_what_it_needs(scene: Any) -> None:
    made = scene(effects={"motor": MOTOR, "gravity": {"tilt": 1.0}})
    added = {variant.name: variant.added for variant in variants(made)}
    assert added["motor"] == ("spindle_acceleration",)
    assert added["gravity"] == ("suspension",)
    assert added["suspension"] == ()


def test_no_ball_starts_where_cosines_are_quick(scene: Any) -> None:
    made, turned = off_axis(scene())
    assert (made.start.ball_angles, turned) == ((2.5, 2.5), 2.5)
    there = scene(start={"ball_angles": [0.1, 0.2]})
    assert off_axis(there) == (there, 0.0)


def test_leave_one_out_skips_what_another_effect_needs(scene: Any) -> None:
    names = [v.name for v in variants(scene(effects={"motor": MOTOR}), leave_one_out=True)]
    assert "all but motor" in names and "all but viscous_drag" in names
    assert "all but spindle_acceleration" not in names


def test_all_variants_take_the_scenes_stepper(scene: Any) -> None:
    made = scene(effects={"viscous_drag": {"coefficient": 100.0}}, solver={"stepper": "auto"})
    assert {variant.scene.solver.stepper for variant in variants(made)} == {"imex8"}


def test_numbers_are_complete_and_make_a_report_and_a_picture(scene: Any, tmp_path: Path) -> None:
    told: list[tuple[str, int, int]] = []
    only = {"viscous_drag": None, "spindle_acceleration": None}
    made = scene(effects=only, duration=0.02)
    cost = effect_cost(made, repeats=3, progress=lambda *what: told.append(what))
    assert [row.name for row in cost.rows] == [BASE, "ball_spin", "suspension", ALL]
    assert (cost.steps_per_run, cost.repeats, cost.stepper) == (20, 3, "rk8")
    assert ("measuring", 2, 3) in told
    report = json.loads(json.dumps(cost.report(), allow_nan=False))
    assert {"date", "machine", "versions", "version", "rows", "scene", "step"} <= set(report)
    for row in report["rows"]:
        for spread in (row["ns_per_step"], row["ratio"]):
            assert 0 < spread["least"] <= spread["lower"] <= spread["median"] <= spread["upper"]
        assert row["failure"] == "" and row["first_seconds"] > 0
    assert report["rows"][0]["ratio"]["median"] == 1.0
    save(drawn_cost([cost]), tmp_path / "cost.svg", 120)
    assert "<svg" in (tmp_path / "cost.svg").read_text()


def test_a_variant_that_diverges_says_so_and_the_others_are_measured(
    scene: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from ab_sim.analysis import effect_cost as module
    from ab_sim.base.errors import DivergedError

    class Fragile(module.Drive):
        def advance(self, steps: int = 1) -> Any:
            if list(self.scene.effects) == ["ball_spin"]:
                raise DivergedError("went beyond all bounds")
            return super().advance(steps)

    monkeypatch.setattr(module, "Drive", Fragile)
    made = scene(effects={"viscous_drag": None, "spindle_acceleration": None}, duration=0.01)
    rows = {row.name: row for row in effect_cost(made, repeats=1).rows}
    assert rows["ball_spin"].ns_per_step is None
    assert "beyond all bounds" in rows["ball_spin"].failure
    assert rows[ALL].ns_per_step is not None


def test_bad_input_is_refused(scene: Any) -> None:
    with pytest.raises(InputError, match="at least 1"):
        effect_cost(scene(), repeats=0)
    with pytest.raises(SceneError, match="solver.step = 0.1 s: "):
        effect_cost(scene(solver={"step": 0.1}))


def test_everything_names_every_effect_that_can_be_together() -> None:
    from ab_sim.scene.registry import effect_classes

    named = set(load_scene("everything").effects)
    assert set(effect_classes()) - named == {"suspension"}  # unequal_suspension replaces it
