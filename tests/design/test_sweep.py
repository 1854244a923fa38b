"""Sweeps: their runs are single runs, whatever shares, interrupts or spoils the work."""

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow
import pytest
from pyarrow import csv

import ab_sim
from ab_sim.analysis.metrics import metrics_of, reported_metrics
from ab_sim.analysis.metrics.verdict import Verdict
from ab_sim.base.errors import InputError, SceneError
from ab_sim.base.workers import Workers
from ab_sim.design import judged, work
from ab_sim.design.batch import judging
from ab_sim.design.judged import FAILED
from ab_sim.design.points import points_of, variable_of
from ab_sim.design.sweep import Sweep, open_sweep, run_sweep
from ab_sim.drive.drive import Drive
from tests.forked import start_workers_at_once

METRICS = ("final_whirl_over_e", "peak_whirl_over_e", "settled", "peak_tilt", "in_band_from")
EVERY = tuple(metric.key for metric in reported_metrics() if metric.scalar)
SMOOTH = ("effects.rolling_friction=", "duration=0.4")
OVER = {
    "thesis-hold": ("balls.mass=0.5 g..3 g", "effects.viscous_drag.coefficient=log:0.1..10"),
    "no-ball": ("rotor.eccentricity=1e-5..1e-3", "effects.suspension.damping=0.1..20"),
    "balanced-start-up": ("balls.mass=0.5 g..3 g", "profile.acceleration=10..45"),
    "feeding-deck": ("balls.mass=10 mg..200 mg", "start.speed=0..300"),
    "packed-balls": ("rotor.eccentricity=1e-5..1e-3", "race.radius=10 mm..12 mm"),
    "adaptive-start-up": ("rotor.eccentricity=1e-5..1e-3", "profile.target_speed=20..300"),
}
"""One with friction, one with contact, one in space, one that a controller leads."""


def swept(
    scene: str,
    texts: tuple[str, ...],
    design: str | None,
    *changes: str,
    metrics: tuple[str, ...] = METRICS,
) -> Sweep:
    points = points_of([variable_of(text) for text in texts], design)
    return run_sweep(ab_sim.load_scene(scene, changes), points, metrics)


@pytest.mark.parametrize("scene", OVER)
def test_its_runs_are_single_runs_to_the_bit(scene: str) -> None:
    found = swept(scene, OVER[scene], "lhs:40", "duration=0.3", metrics=EVERY)
    assert set(found.outcomes) <= {each.value for each in Verdict}
    for run in range(0, 40, 3):
        own = found.scene_of(run)
        expected = metrics_of(Drive(own).advance(300), own, EVERY)
        assert expected.report() == found.table.select(EVERY).slice(run, 1).to_pylist()[0]


def sizes(monkeypatch: pytest.MonkeyPatch, enough: float, chunk: float, samples: int) -> None:
    monkeypatch.setattr(work, "ENOUGH", enough)
    monkeypatch.setattr(work, "CHUNK_SECONDS", chunk)
    monkeypatch.setattr(judging, "SAMPLES_AT_ONCE", samples)
    monkeypatch.setattr(judged, "PREPARED_AT_ONCE", max(8, samples // 1000))


@pytest.mark.parametrize("scene", ["thesis-hold", "no-ball"])
def test_it_does_not_depend_on_how_the_work_is_shared(
    scene: str, monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    """Profiles that differ, so that runs beside each other are cut where the others are."""
    texts = (*OVER[scene], "profile.acceleration=30..45", "start.speed=90..99")
    points = points_of([variable_of(text) for text in texts], "sobol:64")
    one = ab_sim.load_scene(scene, ["duration=0.3"])
    start_workers_at_once(monkeypatch)
    tables = []
    for number, (enough, chunk, samples) in enumerate(
        [(1e9, 1.0, 10**6), (1e-9, 1e-9, 3000), (1e-9, 1e9, 10**5)]
    ):
        sizes(monkeypatch, enough, chunk, samples)
        for file in folder.glob("*/*"):
            file.unlink()
        tables.append(run_sweep(one, points, METRICS, Workers(1 + number % 2)).table)
    assert tables[0].equals(tables[1]) and tables[0].equals(tables[2])
    assert len(tables[0]) == 64


def test_what_is_done_is_not_done_again(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    sizes(monkeypatch, 1e-9, 1e-9, 10**6)
    points = points_of([variable_of("balls.mass=1 g..2 g:50")], None)
    scene = ab_sim.load_scene("thesis-hold", SMOOTH)
    real, computed = judged.judged, list[int]()

    def counted(job: Any, chunk: Any) -> pyarrow.Table:
        computed.extend(point.run for point in chunk)
        return real(job, chunk)

    monkeypatch.setattr(work, "judged", counted)

    def stop(what: str, done: int, runs: int) -> None:
        if done >= 20:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_sweep(scene, points, METRICS, tell=stop)
    before = len(computed)
    assert 20 <= before < 50
    (part, *_) = sorted(folder.glob("*/*.parquet"))
    part.write_bytes(part.read_bytes()[:-1] + b"?")  # no longer what its name says
    told = list[tuple[int, int]]()
    found = run_sweep(scene, points, METRICS, tell=lambda _, done, runs: told.append((done, runs)))
    assert len(found.table) == 50 and told[-1] == (50, 50)
    assert 0 < told[0][0] < before and len(computed) == before + 50 - told[0][0]
    assert set(computed) == set(range(50))
    before = len(computed)
    again = run_sweep(scene, points, METRICS)
    assert again.table.equals(found.table) and len(computed) == before
    run_sweep(scene, points, METRICS[:2])
    assert len(computed) == before + 50, "others metrics are another sweep"


def test_two_at_once_do_not_work_twice(folder: Path) -> None:
    points = points_of([variable_of("balls.mass=1 g,2 g")], None)
    scene = ab_sim.load_scene("thesis-hold", SMOOTH)

    def begin_another(*_: object) -> None:
        with pytest.raises(InputError, match="computing the same sweep"):
            run_sweep(scene, points, METRICS)

    run_sweep(scene, points, METRICS, tell=begin_another)
    assert run_sweep(scene, points, METRICS).outcomes


def test_where_nothing_can_be_kept_it_works_all_the_same(
    folder: Path, caplog: pytest.LogCaptureFixture
) -> None:
    folder.rmdir()
    folder.write_text("a file where the folder was", encoding="utf-8")
    found = swept("thesis-hold", ("balls.mass=1 g,2 g",), None, *SMOOTH)
    assert len(found.table) == 2 and "cannot be stored there" in caplog.text


def test_a_run_that_fails_says_why_and_leaves_the_others_alone() -> None:
    texts = ("balls.mass=-1,0.001", "start.ball_rates=[[0.0, 0.0], [1e6, 0.0]]")
    found = swept("thesis-hold", texts, None, *SMOOTH)
    alone = swept("thesis-hold", ("balls.mass=0.001",), None, *SMOOTH)
    assert found.outcomes == {**alone.outcomes, FAILED: 3}
    rows = found.table.to_pylist()
    assert all("balls.mass = -1" in rows[run]["failure"] for run in (0, 1))
    assert "bounds" in rows[3]["failure"] and rows[3]["peak_whirl_over_e"] is None
    assert rows[2]["failure"] is None
    assert rows[2]["peak_whirl_over_e"] == alone["peak_whirl_over_e"][0]
    assert np.isnan(found["peak_whirl_over_e"][[0, 1, 3]]).all()


def test_where_no_point_is_a_scene_nothing_runs() -> None:
    with pytest.raises(SceneError, match="must be at least"):
        swept("thesis-hold", ("balls.mass=-2,-1",), None)
    with pytest.raises(InputError, match="final_ball_angles.* is a list"):
        run_sweep(
            ab_sim.load_scene("thesis-hold"),
            points_of([variable_of("balls.mass=1,2")], None),
            ["final_ball_angles"],
        )


def test_circulating_balls_are_an_outcome() -> None:
    """The case of issue 32: six balls that stall at the critical speed, and turn at 307 rad/s."""
    texts = ("effects.viscous_drag.coefficient=0.1,2",)
    found = swept("balanced-start-up", texts, None, "balls.mass=0.003", "duration=9")
    assert found.table["outcome"].to_pylist()[0] == Verdict.CIRCULATES.value
    assert found.best("final_whirl_over_e") != 0


@pytest.mark.parametrize(("masses", "best"), [("0.1 g,0.6 g", 1), ("0.1 g,0.2 g", 0)])
def test_the_best_start_up_time_is_of_a_balanced_run_if_there_is_one(
    masses: str, best: int
) -> None:
    """Balls that are too light settle sooner, and leave most of the unbalance."""
    found = swept("balanced-start-up", (f"balls.mass={masses}",), None, metrics=("start_up_time",))
    times = found["start_up_time"]
    assert times[0] < times[1]
    assert found.best("start_up_time") == best


def test_it_comes_back_from_its_file(tmp_path: Path) -> None:
    texts = (
        "start.ball_angles=[[0, 1], [2, 3]]",
        "balls.mass=1 g..2 g:2",
        "solver.stepper=rk8,rk4",
    )
    found = swept("thesis-hold", texts, None, *SMOOTH)
    found.write(tmp_path / "s.parquet")
    back = open_sweep(tmp_path / "s.parquet")
    assert back.table.equals(found.table, check_metadata=True)
    assert (back.scene, back.keys, back.metrics) == (found.scene, found.keys, found.metrics)
    assert back.points == found.points and back.shape == (2, 2, 2)
    assert back.unit("balls.mass") == "kg" and back.unit("peak_whirl_over_e") == "e"
    own = back.scene_of(5)
    assert own.start.ball_angles == (2.0, 3.0) and own.balls.masses == (0.001, 0.001)
    assert own.solver.stepper == "rk4"
    frame = found.to_dataframe()
    assert list(frame["solver.stepper"]) == ["rk8", "rk4"] * 4
    found.write(tmp_path / "s.csv")
    assert csv.read_csv(tmp_path / "s.csv").column_names == found.table.column_names
    pandas = pytest.importorskip("pandas")
    assert pandas.read_parquet(tmp_path / "s.parquet")["run"].tolist() == list(range(8))


@pytest.mark.parametrize("content", [b"", b"no parquet at all", None])
def test_a_file_that_is_none_is_refused(content: bytes | None, tmp_path: Path) -> None:
    file = tmp_path / "s.parquet"
    if content is None:
        pyarrow.parquet.write_table(pyarrow.table({"a": [1]}), file)
    else:
        file.write_bytes(content)
    with pytest.raises(InputError, match=r"s\.parquet"):
        open_sweep(file)
    with pytest.raises(InputError, match="cannot be read"):
        open_sweep(tmp_path / "none.parquet")


def test_a_grid_becomes_an_xarray() -> None:
    pytest.importorskip("xarray")
    found = swept("thesis-hold", ("balls.mass=1 g..2 g:3", "start.speed=0,10"), None, *SMOOTH)
    data = found.to_xarray()
    assert data.sizes == {"balls.mass": 3, "start.speed": 2}
    for run in range(6):
        row = found.table.slice(run, 1).to_pylist()[0]
        place = data.sel({"balls.mass": row["balls.mass"], "start.speed": row["start.speed"]})
        assert float(place["peak_whirl_over_e"]) == row["peak_whirl_over_e"]
    assert data["balls.mass"].attrs["units"] == "kg"
    with pytest.raises(InputError, match="are not a grid"):
        swept("thesis-hold", ("balls.mass=1 g..2 g",), "lhs:3", *SMOOTH).to_xarray()


def test_a_small_file_of_too_many_rows_is_refused_by_its_head(tmp_path: Path) -> None:
    """Runs of one value take next to nothing in a file; its stated rows are looked at first."""
    file = tmp_path / "many.parquet"
    table = pyarrow.table({"run": np.zeros(1 << 20, np.int8)})
    with pyarrow.parquet.ParquetWriter(file, table.schema) as writer:
        for _ in range(10):
            writer.write_table(table)
    assert file.stat().st_size < 50_000
    before = pyarrow.total_allocated_bytes()
    with pytest.raises(InputError, match="has 10485760 rows; .* 10000000"):
        open_sweep(file)
    assert pyarrow.total_allocated_bytes() - before < 1 << 20
