"""Metric accumulators of runs, fed block by block; see ``judging``.

Their results have an entry per run.
"""

import cmath
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from ab_sim.analysis.circulation import Circulation, CirculationMarks, circulation_of
from ab_sim.analysis.metrics.judging import JudgedRuns, SampleBlock
from ab_sim.analysis.metrics.statistics import CHANGE, MeanSquares, RotorResiduals, Trends
from ab_sim.analysis.startup import Peaks, first_passage_of_opposite, peaks_between
from ab_sim.base.presentation import TURN
from ab_sim.drive.overlap import Overlap, OverlapAccumulator
from ab_sim.drive.turn_vector import COARSEST
from ab_sim.engine.compiling import Floats, Table, compiled
from ab_sim.scene.model import Scene
from ab_sim.tracing.functions import cos_sin

BAND = 0.1
"""Half-width of the band around the final whirl, as a fraction of the final whirl."""
FLOOR = 0.05
"""Least half-width of the band, relative to M0 e / M.

M0 e / M is the disc's whirl far above the critical speed, without balls.
"""
TURNS = 2
"""Least number of spindle revolutions in the last stretch for once-per-turn vibration."""
EARLIER = 3
"""Number of stretches before the last one with which a changing whirl is compared.

The last stretch alone may cover only the rise of a beat.
"""
_AROUND = ("time", "x", "y", "vx", "vy")
"""Channels from which a peak between samples is interpolated."""


def rms(values: np.ndarray) -> float:
    """Return the root mean square of all values."""
    return float(np.sqrt(np.mean(values**2)))


class PeakAccumulator:
    """Largest whirl, interpolated between samples."""

    def __init__(self, runs: JudgedRuns) -> None:
        self._whirl, self._step = np.full(len(runs), -np.inf), np.full(len(runs), np.nan)
        self._inside = np.zeros(len(runs), bool)
        self._around = np.zeros((len(_AROUND), len(runs), 3))

    def take(self, block: SampleBlock) -> None:
        """Process the next samples."""
        joined, every = block.joined, np.arange(block.samples.shape[0])
        whirl = joined.whirl
        top = np.argmax(whirl, axis=1)
        highest, step = whirl[every, top], joined["step"][every, top]
        # Consider the peak again if it was the last sample of the previous block: now its successor
        # is known.
        again = (step == self._step) & (top > 0)
        new = np.flatnonzero((highest > self._whirl) | again)
        self._whirl[new], self._step[new] = highest[new], step[new]
        at = top[new]
        self._inside[new] = (at > 0) & (at < len(joined) - 1)
        beside = np.clip(at[:, None] + [-1, 0, 1], 0, len(joined) - 1)
        for values, channel in zip(self._around, _AROUND, strict=True):
            values[new] = joined[channel][new[:, None], beside]

    @cached_property
    def peaks(self) -> Peaks:
        """Largest whirl of each run [m] and its time [s]."""
        peaks = Peaks(self._whirl.copy(), self._around[0, :, 1].copy())
        inside = self._inside
        if inside.any():
            between = peaks_between(*self._around[:, inside])
            higher = between.whirl > peaks.whirl[inside]
            for peak, other in zip(peaks, between, strict=True):
                peak[inside] = np.where(higher, other, peak[inside])
        return peaks


class FinalWhirlAccumulator:
    """Whirl in the last stretch of each run: root mean square, range and trend."""

    def __init__(self, runs: JudgedRuns) -> None:
        count = len(runs)
        self.mean_squares = MeanSquares(count)
        self._halves = MeanSquares(count), MeanSquares(count)
        self._least, self.largest = np.full(count, np.inf), np.full(count, -np.inf)
        """Largest whirl [m], shape (runs,)."""
        self._trends, self._disc_alone = Trends(count, runs.last), runs.numbers.disc_alone
        self._first_half, self._taken = runs.last - runs.last // 2, 0

    def take(self, block: SampleBlock) -> None:
        """Process the next samples."""
        if block.late == 0:
            return
        whirl = block.late_whirl
        squares = whirl * whirl
        self.mean_squares.take_squares(squares)
        self._trends.take(whirl, squares)
        first = max(self._first_half - self._taken, 0)
        self._halves[0].take_squares(squares[:, :first])
        self._halves[1].take_squares(squares[:, first:])
        self._taken += block.late
        self._least = np.minimum(self._least, whirl.min(axis=1))
        self.largest = np.maximum(self.largest, whirl.max(axis=1))

    @property
    def span(self) -> list[tuple[float, float]]:
        """Smallest and largest whirl of each run [m]."""
        return list(zip(self._least.tolist(), self.largest.tolist(), strict=True))

    @property
    def halves(self) -> list[tuple[float, float]]:
        """Root mean square of the whirl over the first and the second half, for each run [m].

        Both are equal for a single sample.
        """
        first, second = self._halves
        last = second if self._taken > 1 else first
        return list(zip(first.values.tolist(), last.values.tolist(), strict=True))

    @cached_property
    def settled(self) -> np.ndarray:
        """True for each run whose whirl no longer changes, or is negligible.

        The second condition is needed because a decaying whirl changes by a tenth of itself however
        small it is.
        """
        small = self.mean_squares.values <= FLOOR * self._disc_alone
        return np.asarray(small | (self._trends.directions(np.zeros(small.shape)) == 0))

    @property
    def band(self) -> np.ndarray:
        """Half-width of the band around each run's final whirl [m], shape (runs,)."""
        return np.maximum(BAND * self.mean_squares.values, FLOOR * self._disc_alone)


class EarlierWhirlAccumulator:
    """Largest whirl of the ``EARLIER`` stretches before the last one."""

    def __init__(self, runs: JudgedRuns) -> None:
        self._end, self._done = runs.samples - runs.last, 0
        self._begin = self._end - EARLIER * runs.last
        self.largest = np.full(len(runs), -np.inf)
        """Largest whirl of each run [m], shape (runs,)."""

    def take(self, block: SampleBlock) -> None:
        """Process the next samples."""
        first, end = (max(at - self._done, 0) for at in (self._begin, self._end))
        self._done += len(block)
        whirl = block.whirl[:, first:end]
        if whirl.size:
            self.largest = np.maximum(self.largest, whirl.max(axis=1))


class BandAccumulator:
    """Time from which the whirl of a run stays within the band around its final value."""

    AFTER = (FinalWhirlAccumulator,)

    def __init__(self, runs: JudgedRuns, final: FinalWhirlAccumulator) -> None:
        self._final, self._band = final.mean_squares.values[:, None], final.band[:, None]
        self._settled = final.settled
        self._latest, self._done = runs.samples - runs.last, 0
        self._begins = np.zeros(len(runs), int)
        self._times = np.full(len(runs), np.nan)

    def take(self, block: SampleBlock) -> None:
        """Process the next samples."""
        time, count = block["time"], len(block)
        self._times = np.where(self._begins == self._done, time[:, 0], self._times)
        # Number of samples after the last one outside the band; all samples if none is outside.
        inside = np.empty(len(time), int)
        for rows in block.row_blocks():
            outside = np.abs(block.whirl[rows] - self._final[rows]) > self._band[rows]
            last = np.argmax(outside[:, ::-1], axis=1)
            inside[rows] = np.where(outside.any(axis=1), last, count)
        open_runs = np.flatnonzero(inside < count)
        at = count - inside[open_runs]
        self._begins[open_runs] = self._done + at
        crossing_times = time[open_runs, np.minimum(at, count - 1)]
        self._times[open_runs] = np.where(at < count, crossing_times, np.nan)
        self._done += count

    @property
    def times(self) -> list[float | None]:
        """Time from which the whirl stays in the band around its final value [s], per run.

        None if the whirl leaves the band during the last tenth of the run, over which the band is
        computed; None also if the whirl has not settled.
        """
        stays = ((self._begins <= self._latest) & self._settled).tolist()
        times = zip(self._times.tolist(), stays, strict=True)
        return [time if stay else None for time, stay in times]


class ResidualAccumulator:
    """Residual unbalance and residual couple over the last stretch.

    They hold for balls on a round race around the shaft; the contribution of a runout is left out.
    """

    def __init__(self, runs: JudgedRuns) -> None:
        numbers = runs.numbers
        self._rotor = numbers.unbalance
        self.unbalance = RotorResiduals(numbers.moments, numbers.unbalance)
        """Residual unbalance as a fraction of the rotor's."""
        self._trends, self._most = Trends(len(runs), runs.last), numbers.most_unbalance
        self.couple = RotorResiduals(numbers.moments * numbers.heights, numbers.couple)
        """Residual couple as a fraction of the rotor's."""

    def take(self, block: SampleBlock) -> None:
        """Process the next samples."""
        if block.late == 0:
            return
        angles = np.ascontiguousarray(block.late_ball_angles)
        squares = self.unbalance.take(angles)
        self._trends.take(np.sqrt(squares), squares)
        if self.couple.any:
            self.couple.take(angles)

    @property
    def rises(self) -> np.ndarray:
        """True for each run whose residual unbalance rises by a significant part of its limit."""
        return np.asarray(self._trends.directions(CHANGE * self._most) > 0)

    @property
    def moments(self) -> np.ndarray:
        """Residual unbalance [kg m], shape (runs,); that of the balls if the rotor has none."""
        values = self.unbalance.values
        return np.where(self._rotor != 0.0, self._rotor * values, values)


class TiltAccumulator:
    """Tilt of the shaft from its rest direction; no values in the plane."""

    def __init__(self, runs: JudgedRuns) -> None:
        self.peak: list[float | None] = [None] * len(runs)
        """Largest tilt of each run [rad]."""
        self._final, self._runs = MeanSquares(len(runs)), runs

    def take(self, block: SampleBlock) -> None:
        """Process the next samples."""
        if "qw" not in block.channels:
            return
        rests = self._runs.rests
        pairs = zip(rests, block.trajectories, strict=True)
        tilts = np.array([rest.tilt_from(trajectory) for rest, trajectory in pairs])
        for run, most in enumerate(tilts.max(axis=1).tolist()):
            before = self.peak[run]
            self.peak[run] = most if before is None else max(before, most)
        if block.late:
            self._final.take(tilts[:, len(block) - block.late :])

    @property
    def final(self) -> list[float | None]:
        """Root mean square of each run's tilt over the last stretch [rad]."""
        return self._final.values_if_any


class PassageAccumulator:
    """First passage of all balls opposite the unbalance, in a start-up."""

    def __init__(self, runs: JudgedRuns) -> None:
        self.times: list[float | None] = [None] * len(runs)
        """Time of the passage in each run [s]; None if there is none."""
        self._pending = [run for run, scene in enumerate(runs.scenes) if is_start_up(scene)]

    def take(self, block: SampleBlock) -> None:
        """Process the next samples."""
        for run in self._pending:
            self.times[run] = first_passage_of_opposite(block.joined.trajectories[run])
        self._pending = [run for run in self._pending if self.times[run] is None]


class OncePerTurnAccumulator:
    """Once-per-turn part of the whirl in the last stretch, on the rotor's axes.

    A Hann window over the stretch suppresses other frequencies, even if the stretch is not a whole
    number of turns: Harris (1978), Proc. IEEE 66, 51-83.
    """

    def __init__(self, runs: JudgedRuns) -> None:
        self._sums, self._turned = np.zeros((len(runs), 2)), np.zeros(len(runs))
        self._resolved = np.ones(len(runs), bool)
        self._last, self._taken = runs.last, 0
        self._before: np.ndarray | None = None

    def take(self, block: SampleBlock) -> None:
        """Process the next samples."""
        if block.late == 0:
            return
        first = len(block) - block.late
        x, y, angle = (np.ascontiguousarray(block[name][:, first:]) for name in ("x", "y", "angle"))
        share = (self._taken + np.arange(block.late) + 0.5) / self._last
        weights = (1.0 - np.cos(2.0 * np.pi * share)) / self._last
        compiled(_add_on_rotor_axes)(weights, x, y, angle, self._sums)
        turned = np.abs(np.diff(angle, axis=1, prepend=self._angles_before(angle)))
        self._turned += turned.sum(axis=1)
        self._resolved &= turned.max(axis=1) <= COARSEST
        self._taken, self._before = self._taken + block.late, angle[:, -1:]

    def _angles_before(self, angle: np.ndarray) -> np.ndarray:
        """Return the last angles before a block [rad], shape (runs, 1); at the start its first."""
        return angle[:, :1] if self._before is None else self._before

    @property
    def vectors(self) -> list[complex | None]:
        """Once-per-turn vector of each run [m]; None for too few turns or too sparse samples.

        There must be ``TURNS`` revolutions, and samples close enough to resolve them.
        """
        valid = self._resolved & (self._turned >= TURNS * TURN)
        sums_and_validity = zip(self._sums.tolist(), valid.tolist(), strict=True)
        return [complex(*parts) if valid else None for parts, valid in sums_and_validity]

    @property
    def size(self) -> list[float | None]:
        """Magnitude of each run's vector [m]; None without a vector."""
        return [None if vector is None else abs(vector) for vector in self.vectors]

    @property
    def phase(self) -> list[float | None]:
        """Phase of each run's vector from the unbalance [rad]; None without a magnitude."""
        return [cmath.phase(vector) if vector else None for vector in self.vectors]


def _add_on_rotor_axes(weights: Floats, x: Table, y: Table, angle: Table, sums: Table) -> None:
    """Add weighted displacements on axes that turn with the rotor; to be compiled.

    Parameters
    ----------
    weights
        Weights of the samples, shape (samples,).
    x, y
        Displacements of runs on fixed axes [m], shape (runs, samples).
    angle
        Spindle angle psi [rad], same shape.
    sums
        Sums of each run along the rotor's axes [m], shape (runs, 2); updated.
    """
    for run in range(x.shape[0]):
        for k in range(x.shape[1]):
            c, s = cos_sin(angle[run, k])
            sums[run, 0] += weights[k] * (x[run, k] * c + y[run, k] * s)
            sums[run, 1] += weights[k] * (y[run, k] * c - x[run, k] * s)


class LastSampleAccumulator:
    """Last sample of each run."""

    def __init__(self, runs: JudgedRuns) -> None:
        self._last: SampleBlock

    def take(self, block: SampleBlock) -> None:
        """Process the next samples."""
        self._last = block

    @property
    def ball_angles(self) -> list[tuple[float, ...]]:
        """Ball angles of each run [rad], unwrapped, one value per ball."""
        return list(map(tuple, self._last.ball_angles[:, -1].tolist()))

    @property
    def speed(self) -> np.ndarray:
        """Spindle speed of each run [rad/s], shape (runs,)."""
        return self._last["speed"][:, -1]


class FinalCirculationAccumulator:
    """Balls that circulate over the last stretch."""

    def __init__(self, runs: JudgedRuns) -> None:
        self._marks, self._balls = CirculationMarks(runs.last), runs.numbers.moments.shape[1]

    def take(self, block: SampleBlock) -> None:
        """Process the next samples."""
        first = len(block) - block.late
        self._marks.take(
            block["time"][:, first:], block["angle"][:, first:], block.late_ball_angles
        )

    @cached_property
    def circulations(self) -> Sequence[Circulation | None]:
        """Circulating balls of each run; None if no ball circulates."""
        return circulation_of(*self._marks.kept)

    @property
    def any_ball(self) -> list[bool | None]:
        """True for each run with a circulating ball; None without balls."""
        return [bunch is not None if self._balls else None for bunch in self.circulations]


class RunOverlapAccumulator:
    """Overlaps of balls with a size in scenes without contact."""

    def __init__(self, runs: JudgedRuns) -> None:
        self._accumulators = [OverlapAccumulator(scene) for scene in runs.scenes]

    def take(self, block: SampleBlock) -> None:
        """Process the next samples."""
        for accumulator, trajectory in zip(self._accumulators, block.trajectories, strict=True):
            accumulator.take(trajectory)

    @property
    def overlaps(self) -> list[tuple[Overlap, ...] | None]:
        """Overlaps of each run; None if balls cannot overlap."""
        return [accumulator.overlaps for accumulator in self._accumulators]


def is_start_up(scene: Scene) -> bool:
    """Return whether the scene's profile is a start-up."""
    return scene.profile is not None and scene.profile.kind == "start_up"
