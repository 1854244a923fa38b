"""What a run is judged by: how little the deck whirls in the end, and how soon."""

import math
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from ab_sim.analysis.circulation import Circulation, CirculationWatch
from ab_sim.analysis.rest import Rest, rest_of
from ab_sim.analysis.startup import first_passage_of_opposite, peak_whirl
from ab_sim.analysis.trend import Trend
from ab_sim.drive.balance import resultant
from ab_sim.drive.overlap import Overlap, OverlapWatch
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene.model import Scene

LAST = 0.1
"""Final values are root mean squares over this share of the run, at its end."""
BAND = 0.1
"""Half the width of the band around the final whirl, as a share of it ..."""
FLOOR = 0.05
"""... and at least this share of M0 e / M, which is the disc's own whirl far above the critical
speed, without balls."""
ROUNDING = 1e-9
"""A change of the whirl by less than this share of M0 e / M is none."""


class Merits(NamedTuple):
    """Figures of merit of one run. Times count from its start, as the spindle's."""

    peak_whirl: float
    """m."""
    peak_time: float
    """s."""
    final_whirl: float
    """Root mean square over the last stretch [m]."""
    halves: tuple[float, float]
    """The same over the first and the second half of that stretch [m]."""
    changing: bool
    """Whether the final whirl is none: over that stretch it still rises or falls."""
    span: tuple[float, float]
    """Least and largest whirl of the last stretch [m]."""
    band: float
    """Half the width of the band around ``final_whirl`` [m]."""
    in_band_from: float | None
    """From when on the whirl stays within the band [s]; None if it leaves it near the end."""
    residual_unbalance: float | None
    """|M0 e + sum m_i R exp(i theta_i)| / (M0 e), as final value; None without an unbalance."""
    residual_couple: float | None
    """|C + sum m_i R z_i exp(i theta_i)| / |C|, as final value, z_i the height of the ball's race
    and C the rotor's integral of (x + i y) z dm about the same point of the shaft, from which
    heights count; None in the plane, and where C = 0."""
    peak_tilt: float | None
    """Largest angle of the shaft from where it points at rest [rad]; None in the plane."""
    final_tilt: float | None
    """Root mean square of that angle over the last stretch [rad]; None in the plane."""
    first_passage_of_opposite: float | None
    """s; see the function of that name. None but for a start-up with balls."""
    final_ball_angles: tuple[float, ...]
    """From the unbalance, unwrapped [rad], at the end of the run."""
    final_speed: float
    """Of the spindle [rad/s], at the end of the run."""
    circulating: Circulation | None
    """Balls that go round the race over the last stretch, and on; None if none does."""
    overlaps: tuple[Overlap, ...] | None
    """Balls of a size that were in one place, for want of ball_contact; None where none can be."""

    def report(self, eccentricity: float) -> dict[str, object]:
        """As JSON-able values: whirl in eccentricities (None if ``eccentricity`` [m] is 0)."""

        def over_e(whirl: float) -> float | None:
            return whirl / eccentricity if eccentricity > 0 else None

        return {
            "peak_whirl_over_e": over_e(self.peak_whirl),
            "peak_time": self.peak_time,
            "final_whirl_over_e": over_e(self.final_whirl),
            "still_changing": self.changing,
            "band_over_e": over_e(self.band),
            "in_band_from": self.in_band_from,
            "residual_unbalance": self.residual_unbalance,
            "residual_couple": self.residual_couple,
            "peak_tilt": self.peak_tilt,
            "final_tilt": self.final_tilt,
            "first_passage_of_opposite": self.first_passage_of_opposite,
            "final_ball_angles": list(self.final_ball_angles),
            "final_speed": self.final_speed,
            "circulating_balls": self.circulating and self.circulating.report(),
            "overlapping_balls": None
            if self.overlaps is None
            else [overlap._asdict() for overlap in self.overlaps],
        }


def merits_of(trajectory: Trajectory, scene: Scene) -> Merits:
    """Judge a run.

    Args:
        trajectory: consecutive samples, from the start of the run to its end.
        scene: what was run.
    """
    return merits_of_pieces(lambda: iter([trajectory]), len(trajectory), scene)


def merits_of_pieces(
    pieces: Callable[[], Iterable[Trajectory]], count: int, scene: Scene
) -> Merits:
    """Judge a run that is too long to be held in memory, in two passes over it.

    Args:
        segments: begins at the run's start each time it is called; trajectories that follow each
            other, none of them empty.
        count: how many samples there are, at least 1.
        scene: what was run.
    """
    rest, last = rest_of(scene), max(1, round(LAST * count))
    peak, tail, overlaps = _Peak(), _Tail(scene, rest, last), OverlapWatch(scene)
    start_up = scene.profile is not None and scene.profile.kind == "start_up"
    passed, done, before = None, 0, None
    for piece in map(rest.counted_from, pieces()):
        joined = piece if before is None else Trajectory.join([before, piece])
        peak.take(joined)
        if start_up and passed is None:
            passed = first_passage_of_opposite(joined)
        done += len(piece)
        tail.take(piece.last(done - (count - last)))
        peak.take_tilt(piece, rest)
        overlaps.take(piece)
        # Two samples, so that the largest whirl has both its neighbours once.
        before = joined.last(2)
    assert before is not None
    whirl, at = peak_whirl(peak.around)
    final = tail.whirl.value
    disc_alone = scene.eccentric_mass * scene.rotor.eccentricity / scene.total_mass
    band = max(BAND * final, FLOOR * disc_alone)
    begins, time = _in_band_from(map(rest.counted_from, pieces()), final, band)
    return Merits(
        peak_whirl=whirl,
        peak_time=at,
        final_whirl=final,
        halves=(tail.halves[0].value, tail.halves[last > 1].value),
        changing=tail.trend.found(ROUNDING * disc_alone),
        span=tail.span,
        band=band,
        in_band_from=time if begins <= count - last else None,
        residual_unbalance=tail.unbalance.value if tail.has_unbalance else None,
        residual_couple=tail.couple.value if tail.has_couple else None,
        peak_tilt=peak.tilt,
        final_tilt=tail.tilt.value if before.tilts else None,
        first_passage_of_opposite=passed,
        final_ball_angles=tuple(before.ball_angles[-1].tolist()),
        final_speed=float(before["speed"][-1]),
        circulating=tail.circulation.found,
        overlaps=overlaps.found,
    )


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


class _Peak:
    """The largest whirl, with the samples beside it, and tilt."""

    def __init__(self) -> None:
        self.around: Trajectory
        self.tilt: float | None = None
        self._whirl, self._step = -math.inf, math.nan

    def take(self, piece: Trajectory) -> None:
        whirl = piece.whirl
        top = int(np.argmax(whirl))
        step = float(piece["step"][top])
        # The same again where it was the last of a piece: now it has a sample behind it, too.
        if whirl[top] > self._whirl or (step == self._step and top > 0):
            self._whirl, self._step = float(whirl[top]), step
            rows = piece.samples[max(top - 1, 0) : top + 2].copy()
            self.around = Trajectory(piece.channels, rows)

    def take_tilt(self, piece: Trajectory, rest: Rest) -> None:
        if piece.tilts:
            most = float(np.max(rest.tilt_from(piece)))
            self.tilt = most if self.tilt is None else max(self.tilt, most)


class _Tail:
    """The last stretch of a run."""

    def __init__(self, scene: Scene, rest: Rest, count: int) -> None:
        self.whirl, self.tilt, self.unbalance, self.couple = (MeanSquare() for _ in range(4))
        self.halves = (MeanSquare(), MeanSquare())
        self.trend, self.circulation = Trend(count), CirculationWatch(count)
        self.span = (math.inf, -math.inf)
        self._rest, self._first_half, self._taken = rest, count - count // 2, 0
        # Of the balls on a round race around the shaft; what a runout adds is left out.
        moments = np.array(scene.balls.masses) * scene.race.radius
        heights = np.array([scene.race.heights[race] for race in scene.balls.races])
        unbalance = scene.eccentric_mass * scene.rotor.eccentricity
        couple = scene.couple_unbalance
        self.has_unbalance, self.has_couple = unbalance != 0, couple != 0
        self._shares = moments / unbalance if unbalance else None
        self._tilting = moments * heights / couple if couple else None

    def take(self, piece: Trajectory) -> None:
        if len(piece) == 0:
            return
        whirl = piece.whirl
        self.whirl.take(whirl)
        self.trend.take(whirl)
        self.circulation.take(piece)
        first = max(self._first_half - self._taken, 0)
        self.halves[0].take(whirl[:first])
        self.halves[1].take(whirl[first:])
        self._taken += len(piece)
        self.span = min(self.span[0], float(whirl.min())), max(self.span[1], float(whirl.max()))
        if piece.tilts:
            self.tilt.take(self._rest.tilt_from(piece))
        angles = piece.ball_angles
        if self._shares is not None:
            self.unbalance.take(np.abs(1.0 + resultant(self._shares, angles)))
        if self._tilting is not None:
            self.couple.take(np.abs(1.0 + resultant(self._tilting, angles)))


def _in_band_from(pieces: Iterable[Trajectory], final: float, band: float) -> tuple[int, float]:
    """Number and time of the sample after the last one outside; NaN if that one is the last."""
    begins, time, done = 0, math.nan, 0
    for piece in pieces:
        if begins == done:
            time = float(piece["time"][0])
        outside = np.flatnonzero(np.abs(piece.whirl - final) > band)
        if len(outside):
            at = int(outside[-1]) + 1
            begins = done + at
            time = float(piece["time"][at]) if at < len(piece) else math.nan
        done += len(piece)
    return begins, time
