"""Built drives: runs are single runs, more of them go on, what follows is of these very runs."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow
import pytest
import yaml
from scipy import stats

import ab_sim
from ab_sim.analysis.metrics import metrics_of
from ab_sim.analysis.metrics.verdict import Verdict
from ab_sim.base.errors import InputError, SceneError
from ab_sim.design import judged, work
from ab_sim.design.bounds import bound_of
from ab_sim.design.judged import FAILED, OUTCOME, Job, Point, has_settled
from ab_sim.design.spread import Spread
from ab_sim.design.spread_runs import SpreadQuestion, run_spread
from ab_sim.design.sweep import open_sweep
from ab_sim.design.tolerances import tolerance_of
from ab_sim.drive.drive import Drive

pytestmark = pytest.mark.long

SPREAD = ("balls.mass=5% per ball", "rotor.eccentricity=lognormal:20%", "start.ball_angles=random")
SMALL = (bound_of("peak_whirl_over_e<0.55"),)
"""Half of the drives that start up for 0.3 s."""


def spread(scene: str, question: SpreadQuestion, *changes: str, over: Sequence[str] = SPREAD):
    tolerances = [tolerance_of(text) for text in over]
    return run_spread(ab_sim.load_scene(scene, changes), tolerances, question)


@pytest.mark.parametrize(
    ("scene", "change"),
    [
        ("thesis-hold", "effects.rolling_friction="),
        ("feeding-deck", "name=space"),
    ],
)
def test_its_runs_are_single_runs_to_the_bit(scene: str, change: str) -> None:
    asked = SpreadQuestion(24, pairs=4)
    found = spread(scene, asked, change, "duration=0.3")
    assert set(found.runs.outcomes) <= {each.value for each in Verdict}
    for run in range(0, 24, 5):
        own = found.scene_of(run)
        steps = round(own.duration / own.solver.step)
        expected = metrics_of(Drive(own).advance(steps), own, found.runs.metrics)
        row = found.runs.table.select(list(found.runs.metrics)).slice(run, 1)
        assert expected.report() == row.to_pylist()[0]


def fake(job: Job, points: Sequence[Point]) -> pyarrow.Table:
    """Runs whose residual unbalance is the speed at the start, and their whirl a known sum."""
    rows = []
    for point in points:
        given = dict(zip(job.keys, point.values, strict=True))
        speed = given["start.speed"]
        whirl = speed + given.get("start.angle", 0.0)
        metrics = {"residual_unbalance": speed, "final_whirl_over_e": whirl}
        outcome = FAILED if speed > 0.999 else Verdict.BALANCED.value
        rows.append({"run": point.run, **({} if outcome == FAILED else metrics), OUTCOME: outcome})
    return pyarrow.Table.from_pylist(rows, judged.schema_of(job))


UNIFORM = ("start.speed=uniform:0,1",)
KNOWN = SpreadQuestion(
    200, ("residual_unbalance", "final_whirl_over_e"), (bound_of("residual_unbalance<=0.9"),)
)


def test_the_share_until_a_precision_covers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where the number of runs follows from what was found."""
    monkeypatch.setattr(work, "judged", fake)
    monkeypatch.setattr("ab_sim.design.sweep.unit_of", lambda key: "1")  # which takes long
    hits, runs = [], []
    scene, tolerances = ab_sim.load_scene("thesis-hold"), [tolerance_of(UNIFORM[0])]
    for seed in range(60):
        asked = KNOWN._replace(
            seed=seed, runs=100, until=0.03, pairs=0, metrics=("residual_unbalance",)
        )
        found = run_spread(scene, tolerances, asked)
        hits.append(found.share.low <= 0.9 <= found.share.high)
        runs.append(found.share.runs)
        assert found.share.half_width <= 0.03
        assert found.share.balanced == int(np.sum(found["residual_unbalance"] <= 0.9))
    assert 0.89 <= np.mean(hits) <= 0.99, "one standard deviation is 0.03"
    assert 300 < np.mean(runs) < 500, "0.09 (1.96 / 0.03)^2 = 384"


def test_failed_and_restless_runs_are_not_balanced(monkeypatch: pytest.MonkeyPatch) -> None:
    def restless(job: Job, points: Sequence[Point]) -> pyarrow.Table:
        rows = fake(job, points).to_pylist()
        odd = [{**row, OUTCOME: Verdict.CHANGING.value} if row["run"] % 2 else row for row in rows]
        return pyarrow.Table.from_pylist(odd, judged.schema_of(job))

    monkeypatch.setattr(work, "judged", restless)
    asked = KNOWN._replace(runs=2000, criterion=(bound_of("residual_unbalance<=2"),), pairs=0)
    found = spread("thesis-hold", asked, over=UNIFORM)
    failed = np.isnan(found["residual_unbalance"])
    assert failed.any() and not found.balanced[failed].any()
    assert not found.balanced[1::2].any()
    assert found.balanced[::2].sum() == np.sum(~failed[::2])


def test_indices_are_those_of_the_model(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whirl = U(0, 1) + N(0, 1 / 6): a third of the variance is the normal's."""
    monkeypatch.setattr(work, "judged", fake)
    over = ("start.speed=uniform:0,0.99", f"start.angle=normal:0,{0.99 / math.sqrt(24.0)}")
    asked = KNOWN._replace(runs=4096, pairs=2048)
    found = spread("thesis-hold", asked, over=over).sobol
    assert (found.pairs, found.runs) == (2048, 4096)
    speed, angle = found.indices["final_whirl_over_e"]
    assert (speed.factor, angle.factor) == ("start.speed", "start.angle")
    assert [speed.first, speed.total] == pytest.approx([2 / 3] * 2, abs=0.06)
    assert [angle.first, angle.total] == pytest.approx([1 / 3] * 2, abs=0.06)
    whole, none = found.indices["balanced"]
    assert (whole.first, whole.total) == pytest.approx((1.0, 1.0), abs=0.08)
    assert (none.first, none.total) == (pytest.approx(0.0, abs=0.05), 0.0)


def test_where_a_run_has_no_value_there_is_no_index(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(work, "judged", fake)
    over = (*UNIFORM, "start.angle=normal:0,1")
    found = spread("thesis-hold", KNOWN._replace(runs=1024), over=over).sobol
    assert found.pairs == 256 and set(found.missing) == {*KNOWN.metrics}
    assert "runs have no value" in found.missing["residual_unbalance"]
    assert set(found.indices) == {"balanced"}
    one = spread("thesis-hold", KNOWN, over=UNIFORM).sobol
    assert (one.pairs, one.runs, one.indices) == (0, 0, {})
    assert (one.none, found.none) == ("there is one factor only", "")


def test_quantiles_are_of_the_runs_that_have_a_value(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(work, "judged", fake)
    found = spread("thesis-hold", KNOWN._replace(runs=4000), over=UNIFORM)
    values = found["residual_unbalance"]
    for each, p in zip(found.quantiles["residual_unbalance"], (0.05, 0.5, 0.95), strict=True):
        assert each.p == p and each.value == np.nanquantile(values, p)
        assert each.low is not None and each.high is not None and each.low < p < each.high


def test_two_designs_have_the_same_draws() -> None:
    """The other one has heavier balls: its draws are the same deviations."""
    changes = ("duration=0.3", "effects.rolling_friction=")
    other = ab_sim.load_scene("thesis-hold", [*changes, "balls.mass=0.002"])
    asked = SpreadQuestion(60, against=other, criterion=(bound_of("peak_whirl_over_e<0.02"),))
    found = spread("thesis-hold", asked, *changes)
    assert found.against is not None and 5 < found.share.balanced < 55
    masses, others = (
        np.array([each.scene_of(run).balls.masses for run in range(60)])
        for each in (found.runs, found.against.runs)
    )
    assert np.allclose(others / 2.0, masses, rtol=1e-12)
    assert (found["rotor.eccentricity"] == found.against.runs["rotor.eccentricity"]).all()
    paired = found.against.paired
    assert paired.both == int(np.sum(found.balanced & found.against.balanced))
    assert paired.difference == pytest.approx(found.share.value - found.against.share.value)
    difference = found["peak_whirl_over_e"] - found.against.runs["peak_whirl_over_e"]
    assert found.against.metrics["peak_whirl_over_e"].mean == pytest.approx(difference.mean())
    assert "of thesis-hold" in repr(found)


def test_more_runs_go_on_from_those_that_are_there(
    monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    counted: list[int] = []

    def counting(job: Job, points: Sequence[Point]) -> pyarrow.Table:
        counted.extend(point.run for point in points)
        return fake(job, points)

    monkeypatch.setattr(work, "judged", counting)
    asked = KNOWN._replace(pairs=0)
    spread("thesis-hold", asked, over=UNIFORM)
    assert sorted(counted) == list(range(200))
    more = spread("thesis-hold", asked._replace(runs=500), over=UNIFORM)
    assert sorted(counted) == list(range(500))
    less = spread("thesis-hold", asked, over=UNIFORM)
    spread("thesis-hold", asked._replace(runs=500), over=UNIFORM)
    assert len(counted) == 500, "fewer runs have thrown nothing away"
    assert less.runs.table.equals(more.runs.table.slice(0, 200))

    def stop(what: str, done: int, runs: int) -> None:
        if done >= 100:
            raise KeyboardInterrupt

    tolerances = [tolerance_of(text) for text in UNIFORM]
    scene = ab_sim.load_scene("thesis-hold")
    with pytest.raises(KeyboardInterrupt):
        run_spread(scene, tolerances, asked._replace(seed=5), tell=stop)
    before = len(counted) - 500
    run_spread(scene, tolerances, asked._replace(seed=5))
    assert 100 <= before <= 200 and len(counted) == 700


def test_it_does_not_depend_on_how_the_work_is_divided(
    monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    """Worker processes are tested with sweeps, which share the code."""
    scene = ab_sim.load_scene("balanced-start-up", ["duration=0.3"])
    tolerances = [tolerance_of(text) for text in SPREAD]
    found: list[Spread] = []
    for chunk in (1e9, 1e-9):
        monkeypatch.setattr(work, "ENOUGH", 1e-9)
        monkeypatch.setattr(work, "CHUNK_SECONDS", chunk)
        for file in folder.glob("*/*"):
            file.unlink()
        asked = SpreadQuestion(64, pairs=8, criterion=SMALL)
        found.append(run_spread(scene, tolerances, asked))
    one, other = found
    assert one.runs.table.equals(other.runs.table, check_metadata=True)
    assert one.report() == other.report()


def test_the_worst_runs_run_again(tmp_path: Path) -> None:
    asked = SpreadQuestion(50, criterion=SMALL)
    found = spread("balanced-start-up", asked, "duration=0.3")
    values = found["peak_whirl_over_e"]
    assert found.ranked_by == "peak_whirl_over_e" and len(found.worst) == 10
    assert [each.value for each in found.worst] == sorted(values, reverse=True)[:10]
    files = found.write_worst(tmp_path / "worst")
    for each, file in zip(found.worst, files, strict=True):
        scene = ab_sim.load_scene(file)
        assert scene.name == f"balanced-start-up-run-{each.run}"
        again = metrics_of(Drive(scene).advance(300), scene, ["peak_whirl_over_e"])
        assert again["peak_whirl_over_e"] == each.value
        sets = [part.strip("' ") for part in each.changes.split("--set ")[1:]]
        assert ab_sim.load_scene("balanced-start-up", ["duration=0.3", *sets]).balls == scene.balls
    with pytest.raises(InputError, match="is not empty"):
        found.write_worst(tmp_path / "worst")
    with pytest.raises(InputError, match="is a file"):
        found.write_worst(files[0])
    with pytest.raises(InputError, match="there is no folder"):
        found.write_worst(tmp_path / "none" / "worst")


def test_draws_that_are_no_scene_count_and_are_the_worst(tmp_path: Path) -> None:
    over = ("rotor.eccentricity=100%", "balls.mass=1%")
    asked = SpreadQuestion(60, criterion=SMALL, pairs=0)
    found = spread("thesis-hold", asked, "duration=0.1", over=over)
    failed = found["rotor.eccentricity"] < 0.0
    assert found.runs.outcomes[FAILED] == failed.sum() > 1
    assert not found.balanced[failed].any() and found.share.runs == 60
    assert found.worst[0].outcome == FAILED and found.worst[0].value is None
    with pytest.raises(SceneError, match="rotor.eccentricity"):
        found.scene_of(found.worst[0].run)
    files = found.write_worst(tmp_path / "worst")
    assert len(files) == sum(each.outcome != FAILED for each in found.worst)


@pytest.mark.parametrize(("limit", "share"), [("<1e9", 1.0), ("<0", 0.0)])
def test_all_or_none_balanced(limit: str, share: float) -> None:
    asked = SpreadQuestion(40, criterion=(bound_of("peak_whirl_over_e" + limit),), pairs=8)
    asked = asked._replace(against=ab_sim.load_scene("thesis-hold", ["duration=0.2"]))
    found = spread("thesis-hold", asked, "duration=0.2", "effects.viscous_drag.coefficient=9")
    if share:
        settled = has_settled(found["outcome"])
        assert (found.balanced == settled).all()
    else:
        assert not found.balanced.any()
        assert found.sobol.missing["balanced"] == "it does not vary"
    assert found.share.half_width > 0.01
    assert found.share.runs_for(0.001) > 1000
    assert json.loads(json.dumps(found.report(), allow_nan=False))["share"]["runs"] == 40


def test_files_and_reports_have_it_all(tmp_path: Path) -> None:
    found = spread("balanced-start-up", SpreadQuestion(30, criterion=SMALL), "duration=0.2")
    found.write(tmp_path / "s.parquet")
    back = open_sweep(tmp_path / "s.parquet")
    assert back.table.equals(found.runs.table, check_metadata=True)
    assert back.scene_of(7) == found.scene_of(7)
    report: Any = found.report()
    assert report["spread"] == list(SPREAD) and report["criterion"] == ["peak_whirl_over_e<0.55"]
    assert report["balanced"] == found.balanced.tolist()
    assert report["share"]["balanced"] == int(found.balanced.sum())
    assert yaml.safe_load(yaml.safe_dump(report["worst"]))[0]["run"] == found.worst[0].run
    assert found.to_dataframe()["meets_criterion"].tolist() == found.balanced.tolist()


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"until": 0.0}, "until 0: must be a share"),
        ({"until": math.nan}, "until nan"),
        ({"seed": -1}, "seed -1: "),
        ({"pairs": 3}, "sobol 3: must be 0, "),
        ({"pairs": 64}, "must be at most 50"),
        ({"runs": 0}, "0 runs: must be from 1"),
        ({"criterion": ()}, "criterion: is empty"),
        ({"metrics": ("final_ball_angles",)}, "is a list, not a number"),
    ],
)
def test_bad_questions_are_refused(asked: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError) as raised:
        spread("thesis-hold", SpreadQuestion(100)._replace(**asked))
    assert words in str(raised.value)


def test_where_no_draw_is_a_scene_nothing_runs() -> None:
    with pytest.raises(SceneError, match="must be at least"):
        spread("thesis-hold", SpreadQuestion(10), over=("balls.mass=uniform:-2,-1",))
    other = ab_sim.load_scene("no-ball")
    with pytest.raises(InputError, match="^balls.mass: .* no-ball has no balls"):
        spread("thesis-hold", SpreadQuestion(10, against=other), over=("balls.mass=5%",))


def test_rows_have_what_was_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """As many and as spread as was asked for."""
    monkeypatch.setattr(work, "judged", fake)
    found = spread("thesis-hold", KNOWN._replace(runs=3000), over=UNIFORM)
    there = np.isfinite(found["residual_unbalance"])
    assert (found["residual_unbalance"][there] == found["start.speed"][there]).all()
    assert stats.kstest(found["start.speed"], "uniform").pvalue > 0.01


def test_a_spread_that_is_a_number_is_one_error() -> None:
    with pytest.raises(InputError, match="spread of balls.mass = 0.05: "):
        ab_sim.robust("balanced-start-up", {"balls.mass": 0.05})  # type: ignore[dict-item]


def test_drives_that_ring_down_balance() -> None:
    scene = ab_sim.load_scene("balanced-start-up", ["duration=2.5"])
    found = ab_sim.robust(scene, {"balls.mass": "5%"}, runs=16, sobol=0)
    ringing = found.runs.outcomes["balanced, ringing down"]
    assert 0 < ringing < 16 and found.share.balanced == ringing
    chosen = found.runs["outcome"] == "balanced, ringing down"
    assert found.runs["balanced"][chosen].all() and not found.runs["balanced"][~chosen].any()
