"""How far two runs are apart."""

import numpy as np
import pytest

from ab_sim.drive.accuracy.trials import Samples, deviation


def ramp(number: int, balls: int = 2, off: float = 0.0) -> Samples:
    """A deck and balls in uniform motion over one second."""
    t = np.arange(1, number + 1) / number
    return Samples(np.column_stack([t, 2.0 * t + off]), np.tile(t[:, None] - off, (1, balls)))


def test_the_largest_and_the_last_difference() -> None:
    run, reference = ramp(10), ramp(10)
    run.angles[4, 1] += 3.0
    run.angles[9, 0] -= 1.0
    run.position[2] += (0.3, 0.4)
    found = deviation(run, reference, 0.1)
    assert found == pytest.approx((3.0, 5.0, 1.0, 0.0))


def test_runs_are_compared_where_both_have_samples() -> None:
    for one, other in ((ramp(12, off=0.5), ramp(4)), (ramp(4, off=0.5), ramp(12))):
        assert deviation(one, other, 1.0) == pytest.approx((0.5,) * 4)


@pytest.mark.parametrize(
    "other", [ramp(599), ramp(0), ramp(600, balls=3)], ids=["599", "none", "balls"]
)
def test_others_are_refused(other: Samples) -> None:
    with pytest.raises(ValueError, match="cannot be compared"):
        deviation(ramp(600), other, 1.0)
