"""What looks at a run for its merits, piece by piece; see ``judging``."""

import math
from functools import cached_property

import numpy as np

from ab_sim.analysis.circulation import Circulation, CirculationWatch
from ab_sim.analysis.merits.judging import JudgedRun, Piece
from ab_sim.analysis.startup import first_passage_of_opposite, peak_whirl
from ab_sim.analysis.trend import Trend
from ab_sim.drive.balance import resultant
from ab_sim.drive.overlap import Overlap, OverlapWatch
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene.model import Scene

BAND = 0.1
"""Half the width of the band around the final whirl, as a share of it ..."""
FLOOR = 0.05
"""... and at least this share of M0 e / M, which is the disc's own whirl far above the critical
speed, without balls."""
ROUNDING = 1e-9
"""A change of the whirl by less than this share of M0 e / M is none."""


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return math.sqrt(float(np.mean(values**2)))


class MeanSquare:
    """A root mean square that grows with what it is given."""

    def __init__(self) -> None:
        self._sum, self._count = 0.0, 0

    def take(self, values: np.ndarray) -> None:
        """Add values."""
        self._sum += float(np.sum(values**2))
        self._count += len(values)

    @property
    def value(self) -> float:
        """The root of the mean square of all values so far; there must be some."""
        return math.sqrt(self._sum / self._count)

    @property
    def value_if_any(self) -> float | None:
        """The same, None without values."""
        return self.value if self._count else None


class PeakWatch:
    """The largest whirl, found between the samples beside it."""

    def __init__(self, run: JudgedRun) -> None:
        self._around: Trajectory
        self._whirl, self._step = -math.inf, math.nan

    def take(self, piece: Piece) -> None:
        """The next samples."""
        joined = piece.joined
        whirl = joined.whirl
        top = int(np.argmax(whirl))
        step = float(joined["step"][top])
        # The same again where it was the last of a piece: now it has a sample behind it, too.
        if whirl[top] > self._whirl or (step == self._step and top > 0):
            self._whirl, self._step = float(whirl[top]), step
            rows = joined.samples[max(top - 1, 0) : top + 2].copy()
            self._around = Trajectory(joined.channels, rows)

    @cached_property
    def found(self) -> tuple[float, float]:
        """The whirl [m] and its time [s]."""
        return peak_whirl(self._around)


class FinalWhirlWatch:
    """The whirl of the last stretch."""

    def __init__(self, run: JudgedRun) -> None:
        self.mean_square, self._halves = MeanSquare(), (MeanSquare(), MeanSquare())
        self.span = (math.inf, -math.inf)
        """Least and largest [m]."""
        self._trend, self._disc_alone = Trend(run.last), run.disc_alone
        self._first_half, self._taken = run.last - run.last // 2, 0

    def take(self, piece: Piece) -> None:
        """The next samples."""
        if len(piece.late) == 0:
            return
        whirl = piece.late.whirl
        self.mean_square.take(whirl)
        self._trend.take(whirl)
        first = max(self._first_half - self._taken, 0)
        self._halves[0].take(whirl[:first])
        self._halves[1].take(whirl[first:])
        self._taken += len(whirl)
        self.span = min(self.span[0], float(whirl.min())), max(self.span[1], float(whirl.max()))

    @property
    def halves(self) -> tuple[float, float]:
        """Root mean squares over both halves [m]; of one sample it is the same."""
        first, second = self._halves
        return first.value, (second if self._taken > 1 else first).value

    @property
    def changing(self) -> bool:
        """Whether it still rises or falls."""
        return self._trend.found(ROUNDING * self._disc_alone)

    @property
    def settled(self) -> bool:
        """Whether it does not, or is so small that it does not matter.

        A whirl that dies away changes by a tenth of itself however small it has become.
        """
        return not self.changing or self.mean_square.value <= FLOOR * self._disc_alone

    @property
    def band(self) -> float:
        """Half the width of the band around it [m]."""
        return max(BAND * self.mean_square.value, FLOOR * self._disc_alone)


class BandWatch:
    """From when on the whirl stays within its band."""

    AFTER = (FinalWhirlWatch,)

    def __init__(self, run: JudgedRun, final: FinalWhirlWatch) -> None:
        self._final, self._band = final.mean_square.value, final.band
        self._latest = run.samples - run.last
        self._begins, self._time, self._done = 0, math.nan, 0

    def take(self, piece: Piece) -> None:
        """The next samples."""
        samples = piece.trajectory
        if self._begins == self._done:
            self._time = float(samples["time"][0])
        outside = np.flatnonzero(np.abs(samples.whirl - self._final) > self._band)
        if len(outside):
            at = int(outside[-1]) + 1
            self._begins = self._done + at
            self._time = float(samples["time"][at]) if at < len(samples) else math.nan
        self._done += len(samples)

    @property
    def found(self) -> float | None:
        """The time of the sample after the last one outside [s]; None if that comes too late."""
        return self._time if self._begins <= self._latest else None


class ResidualWatch:
    """What balls leave of the rotor's unbalance, and of its couple, over the last stretch.

    Of balls on a round race around the shaft; what a runout adds is left out.
    """

    def __init__(self, run: JudgedRun) -> None:
        scene = run.scene
        moments = np.array(scene.balls.masses) * scene.race.radius
        heights = np.array([scene.race.heights[race] for race in scene.balls.races])
        unbalance = scene.eccentric_mass * scene.rotor.eccentricity
        couple = scene.couple_unbalance
        self.unbalance, self.couple = MeanSquare(), MeanSquare()
        self._moments, self._own, self._balls_alone = moments, unbalance, MeanSquare()
        self._shares = moments / unbalance if unbalance else None
        self._tilting = moments * heights / couple if couple else None

    def take(self, piece: Piece) -> None:
        """The next samples."""
        if len(piece.late) == 0:
            return
        angles = piece.late.ball_angles
        if self._shares is not None:
            self.unbalance.take(np.abs(1.0 + resultant(self._shares, angles)))
        else:
            self._balls_alone.take(np.abs(resultant(self._moments, angles)))
        if self._tilting is not None:
            self.couple.take(np.abs(1.0 + resultant(self._tilting, angles)))

    @property
    def left(self) -> float:
        """What is left of unbalance [kg m]; of a rotor without one that of the balls."""
        return self._own * self.unbalance.value if self._own else self._balls_alone.value


class TiltWatch:
    """How far the shaft leans from where it points at rest; nothing in the plane."""

    def __init__(self, run: JudgedRun) -> None:
        self.peak: float | None = None
        """rad."""
        self.final = MeanSquare()
        """Over the last stretch."""
        self._rest = run.rest

    def take(self, piece: Piece) -> None:
        """The next samples."""
        if not piece.trajectory.tilts:
            return
        most = float(np.max(self._rest.tilt_from(piece.trajectory)))
        self.peak = most if self.peak is None else max(self.peak, most)
        if len(piece.late):
            self.final.take(self._rest.tilt_from(piece.late))


class PassageWatch:
    """The first passage of all balls opposite the unbalance, in a start-up."""

    def __init__(self, run: JudgedRun) -> None:
        self.found: float | None = None
        """s; see ``first_passage_of_opposite``."""
        self._start_up = is_start_up(run.scene)

    def take(self, piece: Piece) -> None:
        """The next samples."""
        if self._start_up and self.found is None:
            self.found = first_passage_of_opposite(piece.joined)


class LastSampleWatch:
    """The last sample."""

    def __init__(self, run: JudgedRun) -> None:
        self._last: Trajectory

    def take(self, piece: Piece) -> None:
        """The next samples."""
        self._last = piece.trajectory.last(1)

    @property
    def ball_angles(self) -> tuple[float, ...]:
        """Rad."""
        return tuple(self._last.ball_angles[-1].tolist())

    @property
    def speed(self) -> float:
        """Of the spindle [rad/s]."""
        return float(self._last["speed"][-1])


class FinalCirculationWatch:
    """Balls that circulate over the last stretch."""

    def __init__(self, run: JudgedRun) -> None:
        self._watch, self._balls = CirculationWatch(run.last), run.scene.balls.count

    def take(self, piece: Piece) -> None:
        """The next samples."""
        if len(piece.late):
            self._watch.take(piece.late)

    @property
    def found(self) -> Circulation | None:
        """None if no ball does."""
        return self._watch.found

    @property
    def any_ball(self) -> bool | None:
        """Whether one does; None without balls."""
        return self.found is not None if self._balls else None


class RunOverlapWatch:
    """Balls of a size that are in one place, for want of contact."""

    def __init__(self, run: JudgedRun) -> None:
        self._watch = OverlapWatch(run.scene)

    def take(self, piece: Piece) -> None:
        """The next samples."""
        self._watch.take(piece.trajectory)

    @property
    def found(self) -> tuple[Overlap, ...] | None:
        """None where none can be."""
        return self._watch.found


def is_start_up(scene: Scene) -> bool:
    """Whether the spindle starts up."""
    return scene.profile is not None and scene.profile.kind == "start_up"
