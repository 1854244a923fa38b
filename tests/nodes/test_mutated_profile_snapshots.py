"""A profile's snapshots with one value changed: refused by InputError, or run on finitely."""

import json
import math
import random
from pathlib import Path

import pytest

from ab_sim.base.errors import InputError
from ab_sim.model.spindle.profile_run import MOST_SPEED, ProfileExecution
from ab_sim.model.spindle.segments_execution import SegmentsExecution
from ab_sim.nodes.adaptive_execution import AdaptiveExecution, Reading, SpindleSample
from ab_sim.nodes.timed_run import read_profile_snapshot, write_profile_snapshot
from tests.drive.mutations import changed
from tests.nodes.test_timed_run import ADAPTIVE, MS, SLOW, Bench, planned

BRISK = (
    "{kind: segments, segments: [{to: 20, acceleration: 200}, "
    "{until: {vibration_rms_below: 0.5, over: 0.05, at_most: 0.5}}, {to: 30, acceleration: 200}]}"
)
EACH = 70
"""Mutations of each profile's snapshot."""


def hear(execution: ProfileExecution | None, now: int) -> None:
    """Let an execution hear a vibration that decays, at a time [ms]."""
    swing = 3.0 * math.exp(-now / 300.0) * math.sin(0.6 * now)
    if isinstance(execution, AdaptiveExecution):
        execution.spindle(SpindleSample(now * MS, 0.05 * now, 50.0))
        execution.reading(Reading(now * MS, swing, -swing))
    elif isinstance(execution, SegmentsExecution):
        execution.receive(now * 1e-3, "pickup", now * MS, (swing, 0.0, 0.0))


def run_on(bench: Bench, until: int) -> list[float]:
    """Commands while a bench's clock goes on [ms]."""
    speeds = []
    while bench.now < until:
        hear(bench.timed.execution, bench.now)
        speeds += bench.to(bench.now + 4)
    return speeds


@pytest.mark.parametrize(
    "profile", [SLOW, BRISK, ADAPTIVE], ids=["known", "on vibration", "adaptive"]
)
@pytest.mark.parametrize("aborted", [False, True])
def test_a_mutated_snapshot_is_refused_or_runs(profile: str, aborted: bool, tmp_path: Path) -> None:
    path, rng = tmp_path / "kept.json", random.Random(profile)
    bench = Bench()
    assert bench.start(profile) == ""
    run_on(bench, 300)
    if aborted:
        bench.timed.abort(bench.now * MS, "a test")
    write_profile_snapshot(path, bench.timed.snapshot())
    content, refused, failures = json.loads(path.read_text()), 0, []
    for _ in range(EACH):
        mutated, words = changed(content, rng)
        path.write_text(json.dumps(mutated))
        again = Bench()
        again.now = 300
        try:
            kept = read_profile_snapshot(path)
            again.timed.restore(again.now * MS, kept, planned(profile), 1.0)
            speeds = [again.leap(300) or 0.0, *run_on(again, 300 + 1200)]
        except InputError as error:
            assert "\n" not in str(error)
            refused += 1
        except Exception as error:
            failures.append(f"{words}: {error!r}")
        else:
            if wild := [speed for speed in speeds if not abs(speed) <= MOST_SPEED]:
                failures.append(f"{words}: commands {wild[:2]}")
    assert not failures, "\n".join(failures)
    assert 0.1 * EACH < refused < EACH
