"""A sizing as a whole: what is claimed is run, and what runs contradict is said."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ab_sim
from ab_sim.base.errors import InputError
from ab_sim.base.workers import Workers
from ab_sim.design.sizing import claims
from ab_sim.design.sizing import size as sizing
from ab_sim.design.sizing.claims import (
    CONTRADICTED,
    HOLDS,
    UNDECIDED,
    Hold,
    Running,
    SpreadRuns,
    run_share,
    scene_of,
    share_claim,
    with_contact,
)
from ab_sim.design.statistics import share_of
from tests.design.sizing.wanted import DRIVE, wanted

HOLD = Hold(105.0, 0.6)
HERE = Running(60, 0, Workers(1), None)


def runs_with(balanced: int, of: int = 100) -> SpreadRuns:
    return SpreadRuns(share_of(np.arange(of) < balanced), 0, 0, None, 1e-4)


def test_a_drive_is_sized_and_its_claims_hold(tmp_path: Path) -> None:
    told: list[tuple[str, int, int]] = []
    found = ab_sim.size(**DRIVE, balls=[5], runs=60, seed=1, progress=lambda *now: told.append(now))
    assert _stages(told) == {
        "5 balls": 60, "drag lowest, 0.000392 N s/m": 60, "drag highest, 0.00273 N s/m": 60,
        "drag far above, 0.0273 N s/m": 60,
    }  # fmt: skip
    assert found.found and found.hold is None and found.scene is not None
    verdicts = [claim.verdict for claim in found.claims]
    assert CONTRADICTED not in verdicts and verdicts.count(HOLDS) >= 7, found.claims
    assert (
        found.at_drags["far above"].runs.share.high < 0.9 < found.at_drags["lowest"].runs.share.low
    )
    report = json.loads(json.dumps(found.report(), allow_nan=False))
    assert report["chosen"]["balls"] == 5 and report["scene"]["balls"]["count"] == 5
    file = tmp_path / "sized.yaml"
    file.write_text(found.scene_text())
    assert file.read_text().startswith("# made by ab-sim size")
    scene = ab_sim.load_scene(file)
    assert scene == found.scene and "ball_contact" in scene.effects
    assert scene.rotor.eccentricity * scene.eccentric_mass == pytest.approx(3e-6)
    assert ab_sim.simulate(scene).metrics["residual_unbalance"] < 0.1
    assert "balls 5" in repr(found) and len(found.plot().axes) == 2


def _stages(told: list[tuple[str, int, int]]) -> dict[str, int]:
    """Return the runs of each stage; each reports some runs before all, and then all."""
    stages: dict[str, list[tuple[int, int]]] = {}
    for what, done, total in told:
        stages.setdefault(what.partition(": ")[0], []).append((done, total))
    for counts in stages.values():
        assert any(0 < done < total for done, total in counts), counts
        assert counts[-1][0] == counts[-1][1], counts
    return {stage: counts[-1][1] for stage, counts in stages.items()}


def test_outside_the_window_too_few_are_in_time() -> None:
    """Below its lower end, where bunches circulate."""
    asked = wanted(balls=[5])
    sized = sizing.sized_balls(5, asked)
    assert sized.balls is not None and sized.window is not None
    scene = with_contact(scene_of(sized.balls, asked, 0.7 * sized.border))
    found = run_share(scene, asked, HERE, drag_too=False)
    assert found.share.high < asked.share and found.failed == 0


@pytest.mark.parametrize(
    ("balanced", "at_least", "verdict"),
    [
        (100, True, HOLDS), (50, True, CONTRADICTED), (92, True, UNDECIDED),
        (50, False, HOLDS), (100, False, CONTRADICTED),
    ],
)  # fmt: skip
def test_shares_are_judged_by_their_interval(balanced: int, at_least: bool, verdict: str) -> None:
    assert share_claim("", runs_with(balanced), 0.9, at_least).verdict == verdict


def test_a_hold_is_as_short_as_it_may_be(monkeypatch: pytest.MonkeyPatch) -> None:
    """As of drives that only balance with holds of 0.6 s and more."""

    def run(sized: Any, hold: Hold | None, *_: Any) -> SpreadRuns:
        return runs_with(95 if hold is not None and hold.duration > 0.5 else 40)

    monkeypatch.setattr(sizing, "run_in_parts", run)
    monkeypatch.setattr(sizing, "window_runs", lambda *_: _at_drags())
    found = sizing.run_sizing(wanted(balls=[5]), HERE)
    assert found.hold == pytest.approx(Hold(105.0, 0.6)) and found.scene is not None
    assert found.scene.profile is not None
    verdicts = {claim.claim: claim.verdict for claim in found.claims}
    assert verdicts["without it"] == HOLDS


def test_a_hold_must_reach_the_share_in_a_part_of_the_runs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its interval includes 90 %; a design without a hold is then run whole, a hold is not."""
    lengths: dict[Hold | None, list[int]] = {}

    def run(scene: Any, _: Any, running: Any, *__: Any) -> SpreadRuns:
        hold = None if scene.profile.variable_speed_period is None else HOLD
        lengths.setdefault(hold, []).append(running.runs)
        return runs_with(88)

    monkeypatch.setattr(sizing, "run_share", run)
    sized, asked = sizing.sized_balls(5, wanted(balls=[5])), wanted(balls=[5])
    for hold in (None, HOLD):
        sizing.run_in_parts(sized, hold, asked, HERE._replace(runs=400))
    assert lengths == {None: [25, 100, 400], HOLD: [25, 100]}


def test_an_end_that_runs_contradict_is_moved(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if drives balanced only within a factor of 1.4 of the drag that is taken."""
    asked = wanted(balls=[5])
    sized = sizing.sized_balls(5, asked)
    middle = float(sized.drag or 0.0)

    def run(scene: Any, *_: Any, **__: Any) -> SpreadRuns:
        drag = scene.effects["viscous_drag"].coefficient
        return runs_with(95 if middle / 1.4 < drag < 1.4 * middle else 40)

    monkeypatch.setattr(claims, "run_share", run)
    found = claims.window_runs(sized, asked, HERE, lambda _: 0.9)
    assert set(found) == {
        "lowest", "lowest, by runs", "highest", "highest, by runs", "far above"
    }  # fmt: skip
    assert middle < found["highest, by runs"].drag < 1.4 * middle < found["highest"].drag


def _at_drags() -> dict[str, sizing.DragRuns]:
    shares = {"lowest": 95, "highest": 95, "far above": 5}
    return {name: sizing.DragRuns(1e-3, n / 100, runs_with(n)) for name, n in shares.items()}


def test_what_runs_contradict_is_not_sized(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sizing, "run_in_parts", lambda *_: runs_with(40))
    found = sizing.run_sizing(wanted(balls="5..6"), HERE)
    assert not found.found and [count for count, _ in found.tried] == [5, 6]
    said = sizing.sizing_failure(found)
    assert "6 balls: 40.0 % balanced" in said
    assert "runs contradict the prediction of 90 %" in said
    assert "), also with each of 12 holds of the speed (variable-speed periods); allow" in said
    assert found.scene_text() == "" and "nothing" in repr(found)
    assert len(found.plot().axes) == 2
    json.dumps(found.report(), allow_nan=False)


@pytest.mark.parametrize(("speed", "holds"), [("125 rad/s", 8), ("104 rad/s", 0)])
def test_holds_are_named_only_where_they_were_tried(
    speed: str, holds: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """None is where the running speed is hardly above the critical one."""
    sized, tried = sizing.sized_balls(5, wanted(balls=[5])), list[Hold | None]()

    def run(sized: Any, hold: Hold | None, *_: Any) -> SpreadRuns:
        tried.append(hold)
        return runs_with(40)

    monkeypatch.setattr(sizing, "run_in_parts", run)
    monkeypatch.setattr(sizing, "sized_balls", lambda *_: sized)
    said = sizing.sizing_failure(sizing.run_sizing(wanted(balls=[5], speed=speed), HERE))
    assert tried.count(None) == 1 and len(tried) == 1 + holds
    assert f"with each of {holds} holds" in said if holds else "hold" not in said


def test_too_few_runs_are_refused() -> None:
    with pytest.raises(InputError, match="^runs = 5: must be from 20"):
        ab_sim.size(**DRIVE, runs=5)
