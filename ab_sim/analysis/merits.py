"""What a run is judged by: how little the deck whirls in the end, and how soon."""

import math
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.rest import from_rest, tilt_from_rest
from ab_sim.analysis.startup import first_passage_of_opposite, peak_whirl
from ab_sim.drive.balance import resultant
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene.model import Scene

LAST = 0.1
"""Final values are root mean squares over this share of the run, at its end."""
BAND = 0.1
"""Half the width of the band around the final whirl, as a share of it ..."""
FLOOR = 0.05
"""... and at least this share of M0 e / M, which is the disc's own whirl far above the critical
speed, without balls."""


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

    @property
    def changing(self) -> bool:
        """Whether the final whirl is none: it still rises or falls when the run ends."""
        first, second = self.halves
        return abs(second - first) > self.band

    def report(self, eccentricity: float) -> dict[str, Any]:
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
        }


def merits_of(trajectory: Trajectory, scene: Scene) -> Merits:
    """Judge a run.

    Args:
        trajectory: consecutive samples, from the start of the run to its end.
        scene: what was run.
    """
    trajectory = from_rest(trajectory, scene)
    time, whirl = trajectory["time"], trajectory.whirl
    tilt = tilt_from_rest(trajectory, scene) if trajectory.tilts else None
    last = max(1, round(LAST * len(time)))
    final = rms(whirl[-last:])
    halves = [rms(half) for half in np.array_split(whirl[-last:], 2) if len(half)]
    disc_alone = scene.eccentric_mass * scene.rotor.eccentricity / scene.total_mass
    band = max(BAND * final, FLOOR * disc_alone)
    outside = np.flatnonzero(np.abs(whirl - final) > band)
    begins = 0 if len(outside) == 0 else int(outside[-1]) + 1
    settled = begins <= len(time) - last
    start_up = scene.profile is not None and scene.profile.kind == "start_up"
    peak, at = peak_whirl(trajectory)
    return Merits(
        peak_whirl=peak,
        peak_time=at,
        final_whirl=final,
        halves=(halves[0], halves[-1]),
        span=(float(np.min(whirl[-last:])), float(np.max(whirl[-last:]))),
        band=band,
        in_band_from=float(time[begins]) if settled else None,
        residual_unbalance=_residual_unbalance(trajectory.ball_angles[-last:], scene),
        residual_couple=_residual_couple(trajectory.ball_angles[-last:], scene),
        peak_tilt=None if tilt is None else float(np.max(tilt)),
        final_tilt=None if tilt is None else rms(tilt[-last:]),
        first_passage_of_opposite=first_passage_of_opposite(trajectory) if start_up else None,
        final_ball_angles=tuple(trajectory.ball_angles[-1].tolist()),
        final_speed=float(trajectory["speed"][-1]),
    )


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return math.sqrt(float(np.mean(values**2)))


def _residual_unbalance(angles: np.ndarray, scene: Scene) -> float | None:
    """Of the balls on a round race around the shaft; what a runout adds is left out."""
    unbalance = scene.eccentric_mass * scene.rotor.eccentricity
    if unbalance == 0:
        return None
    moments = np.array(scene.balls.masses) * scene.race.radius
    return rms(np.abs(1.0 + resultant(moments, angles) / unbalance))


def _residual_couple(angles: np.ndarray, scene: Scene) -> float | None:
    couple = scene.couple_unbalance
    if couple == 0:
        return None
    heights = np.array([scene.race.heights[race] for race in scene.balls.races])
    moments = np.array(scene.balls.masses) * scene.race.radius * heights
    return rms(np.abs(1.0 + resultant(moments, angles) / couple))
