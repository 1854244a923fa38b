"""What looks at runs for their merits, piece by piece; see ``judging``.

What they have found has an entry for each run.
"""

import cmath
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from ab_sim.analysis.circulation import Circulation, CirculationMarks, circulation_of
from ab_sim.analysis.merits.judging import JudgedRuns, Piece
from ab_sim.analysis.merits.mean_squares import MeanSquares
from ab_sim.analysis.merits.residuals import Residuals
from ab_sim.analysis.startup import Peaks, first_passage_of_opposite, peaks_between
from ab_sim.analysis.trend import CHANGE, Trends
from ab_sim.compiling import Floats, Table, compiled
from ab_sim.conventions import TURN
from ab_sim.drive.overlap import Overlap, OverlapWatch
from ab_sim.drive.turn_vector import COARSEST
from ab_sim.scene.model import Scene
from ab_sim.tracing.cosine import cos_sin

BAND = 0.1
"""Half the width of the band around the final whirl, as a share of it ..."""
FLOOR = 0.05
"""... and at least this share of M0 e / M, which is the disc's own whirl far above the critical
speed, without balls."""
TURNS = 2
"""Turns of the spindle that a last stretch must have to show what comes once per turn."""
EARLIER = 3
"""How many stretches before the last one show whether a whirl that still changes rings down: of a
whirl that beats the last one alone may show the rise."""
_AROUND = ("time", "x", "y", "vx", "vy")
"""Channels that a peak between samples is found from."""


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


class PeakWatch:
    """The largest whirls, found between the samples beside them."""

    def __init__(self, runs: JudgedRuns) -> None:
        self._whirl, self._step = np.full(len(runs), -np.inf), np.full(len(runs), np.nan)
        self._inside = np.zeros(len(runs), bool)
        self._around = np.zeros((len(_AROUND), len(runs), 3))

    def take(self, piece: Piece) -> None:
        """The next samples."""
        joined, every = piece.joined, np.arange(piece.samples.shape[0])
        whirl = joined.whirl
        top = np.argmax(whirl, axis=1)
        highest, step = whirl[every, top], joined["step"][every, top]
        # The same again where it was the last of a piece: now it has a sample behind it, too.
        again = (step == self._step) & (top > 0)
        new = np.flatnonzero((highest > self._whirl) | again)
        self._whirl[new], self._step[new] = highest[new], step[new]
        at = top[new]
        self._inside[new] = (at > 0) & (at < len(joined) - 1)
        beside = np.clip(at[:, None] + [-1, 0, 1], 0, len(joined) - 1)
        for values, channel in zip(self._around, _AROUND, strict=True):
            values[new] = joined[channel][new[:, None], beside]

    @cached_property
    def found(self) -> Peaks:
        """The whirls [m] and their times [s]."""
        peaks = Peaks(self._whirl.copy(), self._around[0, :, 1].copy())
        inside = self._inside
        if inside.any():
            between = peaks_between(*self._around[:, inside])
            higher = between.whirl > peaks.whirl[inside]
            for own, other in zip(peaks, between, strict=True):
                own[inside] = np.where(higher, other, own[inside])
        return peaks


class FinalWhirlWatch:
    """The whirl of the last stretch."""

    def __init__(self, runs: JudgedRuns) -> None:
        count = len(runs)
        self.mean_squares = MeanSquares(count)
        self._halves = MeanSquares(count), MeanSquares(count)
        self._least, self._most = np.full(count, np.inf), np.full(count, -np.inf)
        self._trends, self._disc_alone = Trends(count, runs.last), runs.numbers.disc_alone
        self._first_half, self._taken = runs.last - runs.last // 2, 0

    def take(self, piece: Piece) -> None:
        """The next samples."""
        if piece.late == 0:
            return
        whirl = piece.late_whirl
        squares = whirl * whirl
        self.mean_squares.take_squares(squares)
        self._trends.take(whirl, squares)
        first = max(self._first_half - self._taken, 0)
        self._halves[0].take_squares(squares[:, :first])
        self._halves[1].take_squares(squares[:, first:])
        self._taken += piece.late
        self._least = np.minimum(self._least, whirl.min(axis=1))
        self._most = np.maximum(self._most, whirl.max(axis=1))

    @property
    def largest(self) -> np.ndarray:
        """m, shape (runs,)."""
        return self._most

    @property
    def span(self) -> list[tuple[float, float]]:
        """Least and largest [m]."""
        return list(zip(self._least.tolist(), self._most.tolist(), strict=True))

    @property
    def halves(self) -> list[tuple[float, float]]:
        """Root mean squares over both halves [m]; of one sample it is the same."""
        first, second = self._halves
        last = second if self._taken > 1 else first
        return list(zip(first.values.tolist(), last.values.tolist(), strict=True))

    @cached_property
    def settled(self) -> np.ndarray:
        """Whether it does not change any more, or is too small to matter.

        A whirl that dies away changes by a tenth of itself however small it has become.
        """
        small = self.mean_squares.values <= FLOOR * self._disc_alone
        return np.asarray(small | (self._trends.found(np.zeros(small.shape)) == 0))

    @property
    def band(self) -> np.ndarray:
        """Half the width of the band around it [m]."""
        return np.maximum(BAND * self.mean_squares.values, FLOOR * self._disc_alone)


class EarlierWhirlWatch:
    """The largest whirl of the stretches before the last one."""

    def __init__(self, runs: JudgedRuns) -> None:
        self._end, self._done = runs.samples - runs.last, 0
        self._begin = self._end - EARLIER * runs.last
        self.largest = np.full(len(runs), -np.inf)
        """m."""

    def take(self, piece: Piece) -> None:
        """The next samples."""
        first, end = (max(at - self._done, 0) for at in (self._begin, self._end))
        self._done += len(piece)
        whirl = piece.whirl[:, first:end]
        if whirl.size:
            self.largest = np.maximum(self.largest, whirl.max(axis=1))


class BandWatch:
    """From when on the whirl stays within its band."""

    AFTER = (FinalWhirlWatch,)

    def __init__(self, runs: JudgedRuns, final: FinalWhirlWatch) -> None:
        self._final, self._band = final.mean_squares.values[:, None], final.band[:, None]
        self._settled = final.settled
        self._latest, self._done = runs.samples - runs.last, 0
        self._begins = np.zeros(len(runs), int)
        self._times = np.full(len(runs), np.nan)

    def take(self, piece: Piece) -> None:
        """The next samples."""
        time, count = piece["time"], len(piece)
        self._times = np.where(self._begins == self._done, time[:, 0], self._times)
        # How many samples there are behind the last one outside; all, if none is.
        inside = np.empty(len(time), int)
        for rows in piece.blocks():
            outside = np.abs(piece.whirl[rows] - self._final[rows]) > self._band[rows]
            last = np.argmax(outside[:, ::-1], axis=1)
            inside[rows] = np.where(outside.any(axis=1), last, count)
        left = np.flatnonzero(inside < count)
        at = count - inside[left]
        self._begins[left] = self._done + at
        found = time[left, np.minimum(at, count - 1)]
        self._times[left] = np.where(at < count, found, np.nan)
        self._done += count

    @property
    def found(self) -> list[float | None]:
        """The time of the sample after the last one outside [s].

        None if that comes too late, or the whirl has not settled: then its band is not the last.
        """
        stays = ((self._begins <= self._latest) & self._settled).tolist()
        times = zip(self._times.tolist(), stays, strict=True)
        return [time if stay else None for time, stay in times]


class ResidualWatch:
    """What balls leave of the rotor's unbalance, and of its couple, over the last stretch.

    Of balls on a round race around the shaft; what a runout adds is left out.
    """

    def __init__(self, runs: JudgedRuns) -> None:
        numbers = runs.numbers
        self._own = numbers.unbalance
        self._unbalance = Residuals(numbers.moments, numbers.unbalance)
        self._trends, self._most = Trends(len(runs), runs.last), numbers.most_unbalance
        self._couple = Residuals(numbers.moments * numbers.heights, numbers.couple)

    def take(self, piece: Piece) -> None:
        """The next samples."""
        if piece.late == 0:
            return
        angles = np.ascontiguousarray(piece.late_ball_angles)
        squares = self._unbalance.take(angles)
        self._trends.take(np.sqrt(squares), squares)
        if self._couple.any:
            self._couple.take(angles)

    @property
    def unbalance(self) -> list[float | None]:
        """Its share that is left; None where there is none."""
        return self._unbalance.found

    @property
    def rises(self) -> np.ndarray:
        """Whether what is left of the unbalance rises, by a share of what may be left."""
        return np.asarray(self._trends.found(CHANGE * self._most) > 0)

    @property
    def couple(self) -> list[float | None]:
        """The same of the couple."""
        return self._couple.found

    @property
    def left(self) -> np.ndarray:
        """What is left of unbalance [kg m]; of a rotor without one that of the balls."""
        values = self._unbalance.values
        return np.where(self._own != 0.0, self._own * values, values)


class TiltWatch:
    """How far the shaft leans from where it points at rest; nothing in the plane."""

    def __init__(self, runs: JudgedRuns) -> None:
        self.peak: list[float | None] = [None] * len(runs)
        """rad."""
        self._final, self._runs = MeanSquares(len(runs)), runs

    def take(self, piece: Piece) -> None:
        """The next samples."""
        if "qw" not in piece.channels:
            return
        rests = self._runs.rests
        each = zip(rests, piece.trajectories, strict=True)
        tilts = np.array([rest.tilt_from(trajectory) for rest, trajectory in each])
        for run, most in enumerate(tilts.max(axis=1).tolist()):
            before = self.peak[run]
            self.peak[run] = most if before is None else max(before, most)
        if piece.late:
            self._final.take(tilts[:, len(piece) - piece.late :])

    @property
    def final(self) -> list[float | None]:
        """Root mean square over the last stretch [rad]."""
        return self._final.values_if_any


class PassageWatch:
    """The first passage of all balls opposite the unbalance, in a start-up."""

    def __init__(self, runs: JudgedRuns) -> None:
        self.found: list[float | None] = [None] * len(runs)
        """s; see ``first_passage_of_opposite``."""
        self._left = [run for run, scene in enumerate(runs.scenes) if is_start_up(scene)]

    def take(self, piece: Piece) -> None:
        """The next samples."""
        for run in self._left:
            self.found[run] = first_passage_of_opposite(piece.joined.trajectories[run])
        self._left = [run for run in self._left if self.found[run] is None]


class OncePerTurnWatch:
    """The part of the last stretch's whirl that comes once per turn, on the rotor's axes.

    Hann's window over the stretch lets through little of what comes otherwise, however the turns
    fit into it.
    """

    def __init__(self, runs: JudgedRuns) -> None:
        self._sums, self._turned = np.zeros((len(runs), 2)), np.zeros(len(runs))
        self._shown = np.ones(len(runs), bool)
        self._last, self._taken = runs.last, 0
        self._before: np.ndarray | None = None

    def take(self, piece: Piece) -> None:
        """The next samples."""
        if piece.late == 0:
            return
        first = len(piece) - piece.late
        x, y, angle = (np.ascontiguousarray(piece[name][:, first:]) for name in ("x", "y", "angle"))
        share = (self._taken + np.arange(piece.late) + 0.5) / self._last
        weights = (1.0 - np.cos(2.0 * np.pi * share)) / self._last
        compiled(add_on_rotor_axes)(weights, x, y, angle, self._sums)
        turned = np.abs(np.diff(angle, axis=1, prepend=self._angles_before(angle)))
        self._turned += turned.sum(axis=1)
        self._shown &= turned.max(axis=1) <= COARSEST
        self._taken, self._before = self._taken + piece.late, angle[:, -1:]

    def _angles_before(self, angle: np.ndarray) -> np.ndarray:
        return angle[:, :1] if self._before is None else self._before

    @property
    def vectors(self) -> list[complex | None]:
        """In m; None with less than ``TURNS`` turns, or samples too far apart to show them."""
        shown = self._shown & (self._turned >= TURNS * TURN)
        each = zip(self._sums.tolist(), shown.tolist(), strict=True)
        return [complex(*parts) if known else None for parts, known in each]

    @property
    def size(self) -> list[float | None]:
        """m."""
        return [None if vector is None else abs(vector) for vector in self.vectors]

    @property
    def phase(self) -> list[float | None]:
        """From the unbalance [rad]; None where there is no size."""
        return [cmath.phase(vector) if vector else None for vector in self.vectors]


def add_on_rotor_axes(weights: Floats, x: Table, y: Table, angle: Table, sums: Table) -> None:
    """Add up weighted displacements on axes that turn with the rotor; to be compiled.

    Args:
        weights: of the samples, shape (samples,).
        x, y: displacements of runs on fixed axes [m], shape (runs, samples).
        angle: psi [rad], the same.
        sums: of each run along the rotor's axes [m], shape (runs, 2); added to.
    """
    for run in range(x.shape[0]):
        for k in range(x.shape[1]):
            c, s = cos_sin(angle[run, k])
            sums[run, 0] += weights[k] * (x[run, k] * c + y[run, k] * s)
            sums[run, 1] += weights[k] * (y[run, k] * c - x[run, k] * s)


class LastSampleWatch:
    """The last sample."""

    def __init__(self, runs: JudgedRuns) -> None:
        self._last: Piece

    def take(self, piece: Piece) -> None:
        """The next samples."""
        self._last = piece

    @property
    def ball_angles(self) -> list[tuple[float, ...]]:
        """Rad."""
        return list(map(tuple, self._last.ball_angles[:, -1].tolist()))

    @property
    def speed(self) -> np.ndarray:
        """Of the spindle [rad/s]."""
        return self._last["speed"][:, -1]


class FinalCirculationWatch:
    """Balls that circulate over the last stretch."""

    def __init__(self, runs: JudgedRuns) -> None:
        self._marks, self._balls = CirculationMarks(runs.last), runs.numbers.moments.shape[1]

    def take(self, piece: Piece) -> None:
        """The next samples."""
        first = len(piece) - piece.late
        self._marks.take(
            piece["time"][:, first:], piece["angle"][:, first:], piece.late_ball_angles
        )

    @cached_property
    def found(self) -> Sequence[Circulation | None]:
        """None if no ball does."""
        return circulation_of(*self._marks.found)

    @property
    def any_ball(self) -> list[bool | None]:
        """Whether one does; None without balls."""
        return [each is not None if self._balls else None for each in self.found]


class RunOverlapWatch:
    """Balls of a size that are in one place, for want of contact."""

    def __init__(self, runs: JudgedRuns) -> None:
        self._watches = [OverlapWatch(scene) for scene in runs.scenes]

    def take(self, piece: Piece) -> None:
        """The next samples."""
        for watch, trajectory in zip(self._watches, piece.trajectories, strict=True):
            watch.take(trajectory)

    @property
    def found(self) -> list[tuple[Overlap, ...] | None]:
        """None where none can be."""
        return [watch.found for watch in self._watches]


def is_start_up(scene: Scene) -> bool:
    """Whether the spindle starts up."""
    return scene.profile is not None and scene.profile.kind == "start_up"
