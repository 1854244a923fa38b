"""Each reading with the spindle at its time, whichever of the two comes first."""

import json
import math

import pytest

from ab_sim.nodes.adaptive_execution import GAP, PairedSamples, Reading, SpindleSample

MS = 1_000_000


class Bench:
    """A spindle that speeds up from 50 rad/s at 100 rad/s^2, and who is told."""

    def __init__(self, turn: float = math.inf) -> None:
        self.told: list[tuple[float, ...]] = []
        self.paired = PairedSamples(lambda *sample: self.told.append(sample))
        self._turn = turn

    def at(self, time: int) -> tuple[float, float]:
        t = time * 1e-9
        return 1.0 + 50.0 * t + 50.0 * t * t, 50.0 + 100.0 * t

    def spindle(self, time: int) -> None:
        angle, speed = self.at(time)
        turn = angle % self._turn if math.isfinite(self._turn) else angle
        self.paired.spindle(SpindleSample(time, turn, speed))

    def reading(self, time: int) -> None:
        self.paired.reading(Reading(time, time * 1e-6, -1.0))


@pytest.mark.parametrize("turn", [math.inf, math.tau])
def test_readings_between_two_samples_of_the_spindle(turn: float) -> None:
    bench = Bench(turn)
    bench.spindle(0)
    for k in range(1, 101):
        bench.reading(k * MS)
        if k % 4 == 0:
            bench.spindle(k * MS)
    bench.reading(98 * MS)  # one that comes late, and is still between the last two
    assert bench.paired.unpaired == 0 and len(bench.told) == 101
    for time, angle, speed, first, second in bench.told:
        right_angle, right_speed = bench.at(round(time * 1e9))
        assert math.remainder(angle - right_angle, math.tau) == pytest.approx(0.0, abs=1e-12)
        assert speed == pytest.approx(right_speed, rel=1e-14)
        assert (first, second) == (pytest.approx(time * 1e3), -1.0)


def test_a_sample_at_the_same_time_is_taken_as_it_is() -> None:
    bench = Bench()
    for k in range(3):
        bench.reading(k * MS)
        bench.spindle(k * MS)
    assert [sample[1:3] for sample in bench.told] == [bench.at(k * MS) for k in range(3)]


def test_what_cannot_be_paired_is_left_out() -> None:
    bench = Bench()
    bench.reading(MS)  # from before the spindle was heard
    bench.spindle(2 * MS)
    bench.reading(10 * MS)
    bench.spindle(3 * MS + GAP)  # it has been silent for too long
    assert bench.told == [] and bench.paired.unpaired == 2
    for bad in (math.nan, math.inf):
        bench.paired.spindle(SpindleSample(4 * MS + GAP, bad, 1.0))
        bench.paired.reading(Reading(3 * MS + GAP, bad, 0.0))
    assert bench.told == []
    bench.reading(60 * MS)
    bench.spindle(0)  # the drive was reset
    bench.spindle(70 * MS)
    assert bench.told == [] and bench.paired.unpaired == 2


def test_it_goes_on_from_its_state() -> None:
    bench, other = Bench(), Bench()
    for k in range(6):
        bench.reading(k * MS)
        if k % 4 == 0:
            bench.spindle(k * MS)
    other.paired.restore(json.loads(json.dumps(bench.paired.state())))
    before = len(bench.told)
    for each in (bench, other):
        each.reading(6 * MS)
        each.spindle(8 * MS)
    assert other.told == bench.told[before:] and len(other.told) == 2
