"""What a picture shows of an adaptive start-up: when it dwelt, and what it believed."""

import math
from pathlib import Path

import numpy as np
import pytest

from ab_sim.analysis import Comparison, run_scene
from ab_sim.analysis.startup import AdaptiveOutcome, net_unbalance
from ab_sim.control import Estimates, State
from ab_sim.drive.controllers import EstimatesAt
from ab_sim.scene import load_scene
from ab_sim.show.adaptive import Stretch, stretches
from ab_sim.show.run import drawn_run
from tests.show.collisions import overlaps, written

STATES = {0.0: State.WAITING, 0.1: State.RUN_UP, 0.8: State.DWELL, 1.4: State.TO_FINAL}
STATES |= {2.0: State.JUDGING, 2.5: State.RETRY, 2.9: State.DWELL, 3.3: State.DONE}


def believed(time: float) -> EstimatesAt:
    state = next(state for begins, state in reversed(STATES.items()) if begins <= time)
    if time < 0.6:
        return EstimatesAt(time, state, *[math.nan] * 4)
    return EstimatesAt(time, state, 99.0, 0.5, 0.9e-4 * math.exp(-time), 5e-6)


@pytest.fixture(scope="module")
def outcome() -> AdaptiveOutcome:
    history = tuple(believed(float(time)) for time in np.arange(0, 801) * 0.005)
    estimates = Estimates(99.0, 0.5, complex(2e-6, 0.0), 1e-6, 0.9e-4, 2, 1)
    return AdaptiveOutcome(State.DONE, "done", estimates, history)


def test_stretches_follow_each_other(outcome: AdaptiveOutcome) -> None:
    found = list(stretches(outcome.history))
    assert [each.state for each in found] == list(STATES.values())
    assert [each.begin for each in found] == pytest.approx(list(STATES), abs=1e-9)
    assert [each.end for each in found[:-1]] == [each.begin for each in found[1:]]
    assert found[-1] == Stretch(State.DONE, pytest.approx(3.3), pytest.approx(4.0))
    assert list(stretches(())) == []


def test_it_shows_what_was_done_and_believed(outcome: AdaptiveOutcome, tmp_path: Path) -> None:
    run = run_scene(load_scene("adaptive-start-up", ["duration=4"]))
    figure = drawn_run(run.trajectory, run.scene, Comparison(None, None), adaptive=outcome)
    texts = written(figure)
    said = [text for text, _ in texts]
    assert "Adaptive start-up of adaptive-start-up" in said
    assert {"dwell 1", "retry 1", "dwell 2", "done"} <= {*said} and "judging" not in said
    assert sum("estimated" in text for text in said) == sum("true" in text for text in said) == 1
    assert list(overlaps(texts)) == []
    figure.savefig(tmp_path / "run.png")


def test_what_is_true_is_the_residual_unbalance_in_other_words() -> None:
    run = run_scene(load_scene("adaptive-start-up", ["duration=0.5", "start.speed=199"]))
    scene = run.scene
    own = scene.eccentric_mass * scene.rotor.eccentricity / scene.total_mass
    last = net_unbalance(run.trajectory.last(50), scene) / own
    assert np.sqrt(np.mean(last**2)) == pytest.approx(run.metrics.residual_unbalance, rel=1e-3)


def test_what_is_not_known_is_none_in_reports(outcome: AdaptiveOutcome) -> None:
    assert outcome.report()["critical_speed"] == 99.0
    nothing = Estimates(*[math.nan] * 2, complex(math.nan, math.nan), *[math.nan] * 2, 0, 0)
    report = outcome._replace(estimates=nothing).report()
    assert [report[key] for key in ("critical_speed", "net_unbalance", "dwells")] == [None, None, 0]
