"""Steps at 0.99 and 1.01 of the stability limit.

Beyond the limit an explicit stepper makes huge numbers out of nothing, sometimes finite ones.
Asserted: what is accepted stays bounded at 0.99 of the named limit; at 1.01 the scene is refused,
and the refusal names a step that is accepted.
"""

import re

import numpy as np
import pytest

from ab_sim.base.errors import SceneError
from ab_sim.drive import Drive
from tests.hard_cases.extremes import scene_of


@pytest.mark.parametrize("stepper", ["rk4", "tsit5", "rk8"])
def test_at_the_limit(stepper: str) -> None:
    longest = Drive(scene_of(solver={"stepper": stepper, "step": 1e-4})).choice.longest
    below, above = (round(factor * longest, 9) for factor in (0.99, 1.01))
    drive = Drive(scene_of(solver={"stepper": stepper, "step": below}))
    run = drive.advance(round(2.0 / below))
    assert np.isfinite(run.samples).all() and run.whirl.max() < 0.01
    with pytest.raises(SceneError, match="solver.step = .* stability limit") as refusal:
        Drive(scene_of(solver={"stepper": stepper, "step": above}))
    named = re.search(r"use at most (\S+) s", str(refusal.value))
    assert named is not None
    Drive(scene_of(solver={"stepper": stepper, "step": float(named[1])})).advance(10)
