"""Runs with friction, contact or a motor, side by side: each is its Drive's to the bit."""

import math
from typing import Any, NamedTuple

import numpy as np
import pytest

from ab_sim.analysis.metrics import metrics_of
from ab_sim.analysis.metrics.metric import reported_metrics
from ab_sim.base.errors import DivergedError
from ab_sim.design.batch import simulate_batch
from ab_sim.design.batch.lane_group import LaneGroup, LaneStarts
from ab_sim.design.batch.prepared_run import PreparedRun
from ab_sim.design.batch.simulate import varied
from ab_sim.drive import Drive
from ab_sim.engine.stepping.side_by_side import LaneSamples
from ab_sim.model.dynamics.system import DIRECTION, JOINED, LOADED, TURNS
from ab_sim.scene import Scene, load_scene
from tests.deck.scenes import odd

Variations = list[dict[str, Any]]
KEYS = [metric.key for metric in reported_metrics()]


class Case(NamedTuple):
    """Scenes that differ in numbers."""

    base: Scene
    variations: Variations


def at_random(runs: int, seed: int, balls: int = 2) -> Variations:
    """Numbers that bring events at other times, breakpoints elsewhere, and balls that meet."""
    rng = np.random.default_rng(seed)
    return [
        {
            "rotor.eccentricity": float(rng.uniform(0.3e-4, 2e-4)),
            "balls.mass": float(rng.uniform(4e-4, 1.2e-3)),
            "effects.viscous_drag.coefficient": float(rng.uniform(0.1, 1.0)),
            "effects.rolling_friction.arm": float(10.0 ** rng.uniform(-6.0, -4.5)),
            "profile.acceleration": float(rng.uniform(150.0, 500.0)),
            "start.ball_angles": (
                np.cumsum(rng.uniform(0.4, 5.5 / balls, balls)) - rng.uniform(0.0, 9.0)
            ).tolist(),
        }
        for _ in range(runs)
    ]


def friction() -> Case:
    changes = [
        "duration=0.6",
        "start.speed=60",
        "profile.variable_speed_period.duration=0.1",
        "spindle.max_acceleration=1000",
        "solver.stepper=rk8",
    ]
    return Case(load_scene("balanced-start-up", changes), at_random(11, 1))


def contact() -> Case:
    changes = ["duration=0.3", "start.speed=90", "spindle.max_acceleration=1000", "balls.count=4"]
    changes += ["balls.mass=5e-4", "solver.stepper=rk8"]
    return Case(load_scene("packed-balls", changes), at_random(9, 2, 4))


def packed_row() -> Case:
    """Balls that start in a row, joined, and come apart."""
    base, changes = contact()
    for change in changes:
        del change["start.ball_angles"]
    return Case(base, changes)


def motor() -> Case:
    changes = ["duration=0.5", "start.speed=95", "spindle.max_acceleration=1000"]
    changes += ["effects.rolling_friction.arm=1e-5", "solver.stepper=rk8"]
    variations = at_random(9, 3)
    for k, change in enumerate(variations):
        change["effects.motor.torque_limit"] = 3e-4 * (1 + k)
    return Case(load_scene("weak-motor", changes), variations)


def in_space() -> Case:
    own = {
        "effects": {"rolling_friction": {"arm": 2e-5}, "gravity": {"acceleration": 9.8}},
        "duration": 0.4,
        "solver": {"stepper": "rk4", "step": 5e-4},
        "start": {"speed": 20.0, "ball_angles": [0.2, 3.0]},
    }
    base = odd("all", own)
    return Case(base, [{"effects.gravity.tilt": 0.3 * k, "start.angle": 5.0 * k} for k in range(5)])


CASES = {case.__name__: case for case in (friction, contact, packed_row, motor, in_space)}


@pytest.mark.parametrize("name", ["balanced-start-up", "weak-motor", "packed-balls"])
def test_scenes_without_balls(name: str) -> None:
    """Laws of events, and nothing that they are about; but for a motor."""
    angles = [] if name == "packed-balls" else ["start.ball_angles="]
    base = load_scene(name, ["duration=0.2", "balls.count=0", *angles])
    variations: Variations = [{"rotor.eccentricity": 1e-4 * (1 + k)} for k in range(3)]
    batch = simulate_batch(base, variations)
    assert batch.in_lanes == 3
    for run in batch.runs:
        alone = Drive(run.scene).advance(steps_of(run.scene))
        assert run.trajectory.samples.tobytes() == alone.samples.tobytes()


def steps_of(scene: Scene) -> int:
    return math.ceil(scene.duration / scene.solver.step - 1e-9)


@pytest.mark.parametrize("name", CASES)
def test_samples_and_metrics_are_those_of_drives(name: str) -> None:
    base, variations = CASES[name]()
    batch = simulate_batch(base, variations, metrics=KEYS, samples=True)
    judged = simulate_batch(base, variations, metrics=KEYS)
    assert batch.in_lanes == judged.in_lanes == len(variations)
    events = set()
    for number, (run, scene) in enumerate(zip(batch.runs, varied(base, variations), strict=True)):
        drive = Drive(scene)
        alone = drive.advance(steps_of(scene))
        assert run.failure == judged.failures[number] == ""
        assert run.trajectory.samples.tobytes() == alone.samples.tobytes()
        expected = metrics_of(alone, scene, KEYS).report()
        for key in KEYS:
            found = judged.metrics[key][number]
            assert found == expected[key] or expected[key] is None and found != found, key
        events.add(drive.events)
    assert max(events) > 3 and len(events) > 1, "and not all have as many"


@pytest.mark.parametrize("name", CASES)
def test_states_branches_and_counts_are_those_of_drives(name: str) -> None:
    base, variations = CASES[name]()
    runs = [PreparedRun(scene) for scene in varied(base, variations[:8])]
    group, steps = LaneGroup(runs[0], 1), runs[0].steps
    samples = LaneSamples.by_sample(np.empty((8, steps, len(runs[0].channels))))
    keys = [run.step_plan_key for run in runs]
    for _ in range(2):  # nothing is left of the first time
        sound, _ = group.run(LaneStarts.of(runs), keys, samples)
    (work,) = group.works.values()
    assert sound.tolist() == [steps] * 8
    for lane, run in enumerate(runs):
        drive, alone = Drive(run.scene), work.alone[lane]
        drive.advance(steps)
        kept = drive.snapshot()
        assert work.lanes.state[:, lane].tobytes() == kept.state.tobytes()
        branches = slice(None), [DIRECTION, LOADED, JOINED]
        assert alone.balls.discrete[branches].tolist() == kept.discrete_state[branches].tolist()
        turns = work.lanes.turns[:, lane]
        assert turns.tolist() == kept.discrete_state[: len(turns), TURNS].tolist()
        assert alone.work.counts[0] == drive.events
        assert alone.work.counts[1] == drive.steps_with_unresolved_events


def test_whatever_runs_beside_it_and_where() -> None:
    base, variations = friction()
    together = simulate_batch(base, variations).runs
    backwards = simulate_batch(base, variations[::-1]).runs[::-1]
    mixed = simulate_batch(base, [variations[3], {}, *variations[5:9], {"duration": 0.3}]).runs
    for one, other in zip(together, backwards, strict=True):
        assert one.trajectory.samples.tobytes() == other.trajectory.samples.tobytes()
    for k, other in ((3, 0), *((5 + i, 2 + i) for i in range(4))):
        found = mixed[other].trajectory.samples
        assert found.tobytes() == together[k].trajectory.samples.tobytes()
    assert len(mixed[-1].trajectory) == 300


def test_every_so_many_and_parts_of_steps() -> None:
    """Breakpoints fall within steps, at other places in each run."""
    base, _ = friction()
    key = "profile.variable_speed_period.duration"
    variations: Variations = [{key: 0.05 + 0.00137 * i} for i in range(5)]
    for run in simulate_batch(base, variations, every=7).runs:
        alone = Drive(run.scene).advance(steps_of(run.scene), 7)
        assert run.trajectory.samples.tobytes() == alone.samples.tobytes()


def test_a_run_that_diverges_leaves_the_others_alone() -> None:
    base, variations = friction()
    wild = {"rotor.eccentricity": 0.9, "start.speed": 99.0, "race.radius": 0.003, "profile": None}
    wild |= {"effects.viscous_drag.coefficient": 0.0, "effects.rolling_friction.arm": 1e-6}
    batch = simulate_batch(base, [variations[0], wild, variations[1]])
    assert batch.in_lanes == 3
    assert [bool(run.failure) for run in batch.runs] == [False, True, False]
    for run in batch.runs:
        drive = Drive(run.scene)
        if run.failure:
            with pytest.raises(DivergedError):
                drive.advance(steps_of(run.scene))
            sound = drive.steps
            assert f"beyond all bounds at t = {(sound + 1) * base.solver.step:.9g} s" in run.failure
            drive.reset()
            assert 1 < sound < 600
        else:
            sound = steps_of(run.scene)
        assert run.trajectory.samples.tobytes() == drive.advance(sound).samples.tobytes()
