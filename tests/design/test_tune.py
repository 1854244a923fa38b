"""Tuning finds what a brute-force grid finds, keeps to bounds, and says where there is nothing."""

import math
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest

import ab_sim
from ab_sim.analysis.metrics.verdict import Verdict
from ab_sim.base.errors import InputError, Interrupted, SceneError
from ab_sim.design.bounds import bound_of
from ab_sim.design.judged import FAILED, has_settled
from ab_sim.design.points import Range, variable_of
from ab_sim.design.search import Aim, Task, best_of, scored, search
from ab_sim.design.tune import NO_PERIOD, Tuning, aim_of, run_tuning


def tuned(
    scene: str, vary: tuple[str, ...], aim: str, bounds: tuple[str, ...] = (), *changes: str,
    runs: int = 150, largest: bool = False,
) -> Tuning:  # fmt: skip
    ranges = [variable_of(text) for text in vary]
    chosen = tuple(each for each in ranges if isinstance(each, Range))
    wanted = aim_of(None, aim) if largest else aim_of(aim, None)
    bounds_ = tuple(bound_of(each) for each in bounds)
    return run_tuning(Task(ab_sim.load_scene(scene, changes), chosen, wanted, bounds_, runs))


DRAG = "effects.viscous_drag.coefficient=log:0.1..2"
HOLD = "profile.variable_speed_period"
CASES = {
    "damping for the least whirl": (
        "no-ball",
        ("effects.suspension.damping=0.2..60",),
        "final_whirl_over_e",
        ("peak_whirl_over_e<5",),
    ),
    "heaviest balls that may be": (
        "balanced-start-up",
        ("balls.mass=0.5 g..3 g",),
        "peak_whirl_over_e",
        ("final_whirl_over_e<0.3",),
    ),
    "mass and drag": (
        "balanced-start-up",
        ("balls.mass=0.5 g..1.5 g", DRAG),
        "final_whirl_over_e",
        (),
    ),
    "the hold": (
        "balanced-start-up",
        (f"{HOLD}.duration=0.1..1.5", f"{HOLD}.start_speed=90..130"),
        "start_up_time",
        ("final_whirl_over_e<0.2",),
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_it_is_at_least_as_good_as_a_grid(case: str) -> None:
    """The grid has as many runs as the search may do, and its best is within the same bounds."""
    scene, vary, aim, bounds = CASES[case]
    found = tuned(scene, vary, aim, bounds, runs=120)
    side = 10 if len(vary) == 2 else 100
    grid = ab_sim.sweep(
        scene,
        {each.partition("=")[0]: f"{each.partition('=')[2]}:{side}" for each in vary},
        [aim, *(bound_of(each).metric for each in bounds)],
    )
    good = has_settled(grid["outcome"])
    for each in bounds:
        good &= bound_of(each).holds(grid[bound_of(each).metric])
    best = np.nanmin(np.where(good, grid[aim], np.nan))
    assert found.best is not None and np.isfinite(best)
    assert found.best <= best * 1.002
    # Of what it looked at it names the best; it is a scene, which gives just that.
    within = found.runs[aim][found.scores.within]
    assert found.best == within.min() and found.scene is not None
    again = ab_sim.simulate(found.scene).metrics
    assert again[aim] == found.best
    assert all(bound_of(each).holds(again[bound_of(each).metric]) for each in bounds)


def test_a_search_finds_the_least_of_a_function() -> None:
    ranges = [Range("balls.mass", -5.0, 5.0), Range("balls.count", 0, 20, whole=True)]
    seen: list[np.ndarray] = []

    def costs(values: np.ndarray) -> np.ndarray:
        seen.append(values)
        x, n = values.T
        return np.asarray((x - 1.2345) ** 2 + (n - 7.0) ** 2 + np.sin(5.0 * x) ** 2 * 0.01)

    search(ranges, costs, 600, 1)
    tried = np.vstack(seen)
    best = tried[np.argmin(costs(tried))]
    exact = np.linspace(1.0, 1.5, 500001)
    least = exact[np.argmin((exact - 1.2345) ** 2 + 0.01 * np.sin(5.0 * exact) ** 2)]
    assert best[1] == 7 and abs(best[0] - least) < 1e-3
    assert len(tried) <= 600 + 64 and (tried[:, 1] == np.round(tried[:, 1])).all()


def test_whole_numbers_stay_whole_and_the_same_seed_gives_the_same() -> None:
    def once(seed: int) -> Tuning:
        scene = ab_sim.load_scene("thesis-hold", ["duration=0.3", "start.ball_angles="])
        ranges = (Range("balls.count", 1, 4, whole=True), Range("balls.mass", 1e-3, 2e-3))
        return run_tuning(Task(scene, ranges, aim_of("peak_whirl_over_e", None), (), 40, seed))

    first, again, other = once(0), once(0), once(1)
    assert first.runs.table.equals(again.runs.table)
    assert not first.runs.table.equals(other.runs.table)
    counts = first.runs["balls.count"]
    assert (
        counts.dtype.kind == "i" and set(counts.tolist()) <= {1, 2, 3, 4} and len(set(counts)) > 1
    )


def test_nothing_found_is_said_so() -> None:
    found = tuned("no-ball", ("effects.suspension.damping=0.2..60",), "final_whirl_over_e",
                  ("peak_whirl_over_e<0.1",), runs=40)  # fmt: skip
    assert found.candidate is None and found.best is None and found.scene is None
    assert found.values == {} and found.active == [] and found.nearby == ()
    assert found.report()["found"] is False and "found nothing" in repr(found)
    assert np.isfinite(found.runs["peak_whirl_over_e"]).all() and not found.scores.within.any()


def test_it_says_which_bounds_it_is_at() -> None:
    found = tuned("no-ball", ("effects.suspension.damping=0.2..10",), "peak_whirl_over_e", runs=40)
    assert found.active == ["effects.suspension.damping=10"]
    (less, more) = found.nearby
    assert found.best is not None and less[2] is not None and more[2] is not None
    assert less[2] > found.best > more[2] and more[1] == pytest.approx(10.5, rel=1e-3)
    assert [name for name, _, _ in found.before] == ["as it is"]


def test_interrupted_it_goes_on(folder: Path) -> None:
    told = list[int]()

    def stop(what: str, done: int, runs: int) -> None:
        told.append(done)
        if len(told) == 3:
            raise Interrupted("stopped")

    scene = ab_sim.load_scene("thesis-hold", ["duration=0.3"])
    ranges = (Range("balls.mass", 1e-3, 2e-3),)
    task = Task(scene, ranges, aim_of("peak_whirl_over_e", None), (), 80)
    with pytest.raises(Interrupted):
        run_tuning(task, tell=stop)
    kept = [pyarrow.parquet.read_table(file)["run"] for file in folder.glob("*/*.parquet")]
    assert sorted(run for part in kept for run in part.to_pylist()) == [*range(told[-1])]
    found = run_tuning(task)
    for file in folder.glob("*/*.parquet"):
        file.unlink()
    assert run_tuning(task).runs.table.equals(found.runs.table)


@pytest.mark.parametrize(
    ("vary", "aim", "bounds", "words"),
    [
        ((), "peak_whirl_over_e", (), "nothing varies"),
        (("balls.mass=1..2",) * 2, "peak_whirl_over_e", (), "varies twice"),
        (("balls.mass=1..2",), "peak", (), "no such metric"),
        (("balls.mass=1..2",), "final_ball_angles", (), "is a list, not a number"),
        (("balls.mass=1..2",), "balanced", (), "is better when larger; maximise it"),
        (("balls.mass=1..2",), "peak_whirl_over_e", ("peak_whirl_over_e",), "add a limit"),
    ],
)
def test_what_cannot_be_looked_for_is_refused(
    vary: tuple[str, ...], aim: str, bounds: tuple[str, ...], words: str
) -> None:
    with pytest.raises(InputError) as raised:
        tuned("thesis-hold", vary, aim, bounds)
    assert words in str(raised.value)


def test_ranges_with_scenes_in_their_middle_only_are_searched() -> None:
    """Two balls of 52 g would outweigh the whole rotor, and none has a negative mass."""
    found = tuned(
        "thesis-hold", ("balls.mass=-45 g..52 g",), "peak_whirl_over_e", (),
        "effects.rolling_friction=", "duration=0.4", runs=16,
    )  # fmt: skip
    assert found.best is not None and found.scene is not None
    assert 0.0 < found.scene.balls.masses[0] < 0.05


def test_ranges_without_any_scene_are_refused() -> None:
    with pytest.raises(SceneError, match="must be at least"):
        tuned("thesis-hold", ("balls.mass=-2..-1",), "peak_whirl_over_e")
    with pytest.raises(InputError, match="^aim: .*minimise or to maximise"):
        aim_of(None, None)
    with pytest.raises(InputError, match="^runs = 3: must be from 16"):
        tuned("thesis-hold", ("balls.mass=1 g..2 g",), "peak_whirl_over_e", runs=3)


def test_costs_put_any_run_within_bounds_before_any_other() -> None:
    found = tuned("balanced-start-up", ("balls.mass=0.5 g..3 g",), "peak_whirl_over_e",
                  ("final_whirl_over_e<0.3",), runs=60)  # fmt: skip
    aims, within, costs = found.scores
    assert within.any() and not within.all()
    assert costs[within].max() < costs[~within].min()
    assert (np.diff(aims[within][np.argsort(costs[within])]) >= 0).all()


def test_scores_of_spread_drives_are_what_a_share_of_them_reaches() -> None:
    """Three candidates of four drives; of the last one two did not settle."""
    table = pyarrow.table({
        "peak_whirl_over_e": [1.0, 2.0, 3.0, 4.0, 2.0, 2.0, 2.0, 9.0, 1.0, 1.0, 1.0, None],
        "final_whirl_over_e": [0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.3, 0.1, 0.1, 0.1, 0.1, None],
        "outcome": [Verdict.BALANCED.value] * 10 + [Verdict.CHANGING.value, FAILED],
    })  # fmt: skip
    aim, bounds = aim_of("peak_whirl_over_e", None), (bound_of("final_whirl_over_e<0.2"),)
    task = Task(ab_sim.load_scene("thesis-hold"), (), aim, bounds, 3, draws=4)
    most = scored(table, task._replace(share=0.75))
    assert most.aims.tolist()[:2] == [3.0, 2.0] and math.isnan(most.aims[2])
    assert most.within.tolist() == [True, True, False] and best_of(most) == 1
    every = scored(table, task)
    assert every.within.tolist() == [True, False, False] and best_of(every) == 0
    assert every.costs[0] < every.costs[1] < every.costs[2]
    half = scored(table, task._replace(aim=Aim("peak_whirl_over_e", False), share=0.5))
    assert half.aims.tolist() == [3.0, 2.0, 1.0] and best_of(half) == 0


@pytest.mark.parametrize("limit", [1e-6, 1.0, 1e6])
def test_a_violation_counts_relative_to_its_bound(limit: float) -> None:
    """Three times the bound is 2 of it beyond, and 2/3 on the scale up to 1."""
    table = pyarrow.table({
        "peak_whirl_over_e": [1.0, 1.0], "final_whirl_over_e": [3.0 * limit, 1.0001 * limit],
        "outcome": [Verdict.BALANCED.value] * 2,
    })  # fmt: skip
    aim, bounds = aim_of("peak_whirl_over_e", None), (bound_of(f"final_whirl_over_e<{limit:g}"),)
    costs = scored(table, Task(ab_sim.load_scene("thesis-hold"), (), aim, bounds, 2)).costs
    assert costs[0] - costs[1] == pytest.approx(2.0 / 3.0, abs=2e-4)


def test_with_a_spread_most_drives_are_good_not_the_drawing() -> None:
    """The heaviest balls that balance in the drawing leave none for those that are heavier."""
    scene = ab_sim.load_scene("balanced-start-up", ["effects.rolling_friction="])
    found = ab_sim.tune(
        scene,
        {"balls.mass": "0.5 g..0.9 g"},
        minimise="final_whirl_over_e",
        spread={"balls.mass": "5%", "start.ball_angles": "random"},
        draws=16,
        share=0.75,
        runs=16 * 40,
    )
    assert found.candidate is not None and found.best is not None and found.scene is not None
    assert len(found.runs.table) == 16 * len(found.candidates)
    rows = slice(16 * found.candidate, 16 * found.candidate + 16)
    finals = np.sort(found.runs["final_whirl_over_e"][rows])
    assert found.best == finals[11], "three quarters of sixteen"
    masses = found.runs["balls.mass"].reshape(-1, 16) / found.candidates
    assert np.allclose(masses, masses[0], rtol=1e-12), "the same draws for all"
    assert 0.02 < masses[0].std() < 0.1
    # The drives themselves: each run is the drawing of its candidate, spread.
    assert found.scene.balls.masses[0] == found.values["balls.mass"]
    own = found.runs.scene_of(rows.start + 3)
    assert own.start.ball_angles != found.scene.start.ball_angles
    again = ab_sim.simulate(own).metrics["final_whirl_over_e"]
    assert again == found.runs["final_whirl_over_e"][rows.start + 3]


def test_spreads_that_cannot_be_are_refused() -> None:
    with pytest.raises(InputError, match="mean 'balls.mass'"):
        ab_sim.tune("thesis-hold", {"race.radius": (0.01, 0.02)}, minimise="peak_whirl_over_e",
                    spread={"balls.masss": "5%"})  # fmt: skip
    with pytest.raises(InputError, match="must be from 512"):
        ab_sim.tune("thesis-hold", {"race.radius": (0.01, 0.02)}, minimise="peak_whirl_over_e",
                    spread={"balls.mass": "5%"}, runs=100)  # fmt: skip
    with pytest.raises(InputError, match="share = 2: must be"):
        ab_sim.tune("thesis-hold", {"race.radius": (0.01, 0.02)}, minimise="peak_whirl_over_e",
                    spread={"balls.mass": "5%"}, share=2.0)  # fmt: skip


def test_it_says_what_else_is_as_good() -> None:
    """The scene has a longer hold than it needs; its balls need none to start up."""
    found = tuned("balanced-start-up", (f"{HOLD}.duration=0.1..0.3",), "start_up_time", runs=20)
    assert found.is_better and list(found.as_good) == [NO_PERIOD]
    assert found.best is not None and found.as_good[NO_PERIOD] < found.best
