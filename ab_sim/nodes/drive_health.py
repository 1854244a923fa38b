"""Diagnostics of a running drive; without ROS and without a clock."""

import math
import re
from collections import deque
from collections.abc import Iterable
from typing import NamedTuple

from ab_sim.drive import Drive
from ab_sim.drive.accuracy import WorkPrecision, share_of
from ab_sim.drive.accuracy.live_checks import LiveChecks
from ab_sim.drive.overlap import OverlapAccumulator, overlaps_text
from ab_sim.nodes.pacing import Pacer

PERIOD = 1.0
"""Time between two reports, over which the real-time factor is measured [s]."""
_WINDOWS = (10, 60)
"""Longer windows over which the real-time factor is measured, in units of ``PERIOD``."""
ABSENT = 10.0
"""Least absence of a warning [s] after which its return is logged again."""
NUMBER = re.compile(r"\d+(\.\d+)?")
"""Pattern of numbers in a warning; warnings that differ only in numbers are the same."""


class RealTimeTolerance(NamedTuple):
    """Limits within which a drive counts as running in real time."""

    factor: float
    """Largest relative deviation of the real-time factor from the requested one."""
    lateness: float
    """Largest lateness of a wake-up [s]."""


class DriveHealth:
    """Monitors a drive, its pacing and its error checks.

    Parameters
    ----------
    drive
        Running drive.
    pacer
        Pacer of the drive.
    checks
        Error checks of the drive; None: none.
    tolerance
        Limits beyond which there is a warning.
    work_precision
        Accuracy by which the drive's solver was chosen; None: none requested.
    """

    def __init__(
        self,
        drive: Drive,
        pacer: Pacer,
        checks: LiveChecks | None,
        tolerance: RealTimeTolerance,
        work_precision: WorkPrecision | None = None,
    ) -> None:
        self._drive, self._pacer, self.checks = drive, pacer, checks
        self.tolerance, self._work_precision = tolerance, work_precision
        self.paced = True
        """True if simulated time has to keep pace with the clock."""
        self._reports: deque[tuple[float, int]] = deque([(0.0, 0)], maxlen=max(_WINDOWS) + 1)
        self._factor: float | None = None
        self._unresolved = 0
        self._overlaps, self._looked = OverlapAccumulator(drive.scene), 0

    @property
    def stepper_chosen(self) -> str:
        """Reason for the choice of the drive's stepper."""
        return (
            self._drive.choice.reason
            if self._work_precision is None
            else self._work_precision.reason
        )

    def begin(self, now: float) -> None:
        """Restart the measurement of the real-time factor at a time [s]."""
        self._reports.clear()
        self._reports.append((now, self._drive.steps))
        self._factor = None

    def period_over(self, now: float, paused: bool) -> bool:
        """Return whether a report is due, and if so update the real-time factor.

        Parameters
        ----------
        now
            Present time by the steady clock [s].
        paused
            Whether time is paused; the factor is then not measured.
        """
        since, steps = self._reports[-1]
        if now - since < PERIOD:
            return False
        if paused:
            self._reports.clear()
        else:
            self._factor = (self._drive.steps - steps) * self._drive.step / (now - since)
        self._reports.append((now, self._drive.steps))
        return True

    def state(self, paused: bool) -> str:
        """Return the state of the drive in a few words."""
        if paused:
            return "paused"
        if not self.paced:
            return "running as fast as possible"
        requested = self._pacer.factor
        if self._factor is None or self._off_pace():
            return "running"
        if requested == 1.0:
            return "running in real time"
        return f"running at {requested:g} times real time"

    def warnings(self) -> list[str]:
        """Return the problems since the last call."""
        pacing, drive = self._pacer.recent(), self._drive
        # The drive's count may be below the last one, because a reset sets it to zero.
        crowded = drive.steps_with_unresolved_events - min(
            self._unresolved, drive.steps_with_unresolved_events
        )
        self._unresolved = drive.steps_with_unresolved_events
        warnings = []
        if pacing.dropped:
            warnings.append(f"fell behind: {pacing.dropped} steps were dropped")
        if pacing.worst_lateness > self.tolerance.lateness:
            warnings.append(f"a wake-up was {pacing.worst_lateness:.3f} s late")
        if self._off_pace():
            requested = self._pacer.factor
            what = "in real time" if requested == 1.0 else f"at {requested:g} times real time"
            warnings.append(f"not {what}: factor {self._factor:.3f}")
        if crowded:
            warnings.append(
                f"{crowded} steps had too many events to locate them all; a shorter solver.step "
                "would be more accurate"
            )
        return [*warnings, *self._drift()]

    def values(self) -> dict[str, str]:
        """Return values for the diagnostics; those of pacing count since the configuration."""
        drive, pacing = self._drive, self._pacer.total
        return {
            **self._factors(),
            "simulated time [s]": f"{drive.time:.9g}",
            "overruns": str(pacing.overruns),
            "steps dropped": str(pacing.dropped),
            "worst lateness [s]": f"{pacing.worst_lateness:.6f}",
            **self._pacer.lateness.values("lateness"),
            "scene": drive.scene.name,
            "stepper": drive.stepper.name,
            "stepper chosen": self.stepper_chosen,
            "step [s]": f"{drive.step:g}",
            "events": str(drive.events),
            "steps with unresolved events": str(drive.steps_with_unresolved_events),
            "effects": ", ".join(drive.scene.effects),
            "sensors": ", ".join(drive.scene.sensors),
            **self._overlapping(),
            **self._estimates(),
        }

    def _overlapping(self) -> dict[str, str]:
        """Return the overlaps of balls; empty if balls cannot overlap.

        Checking at each report suffices: a ball that has passed another in between is noticed
        afterwards.
        """
        drive = self._drive
        if not self._overlaps.possible:
            return {}
        if drive.steps < self._looked:  # the drive was reset
            self._overlaps = OverlapAccumulator(drive.scene)
        self._looked = drive.steps
        self._overlaps.take(drive.present())
        return {"balls overlap": overlaps_text(self._overlaps.overlaps)}

    def _factors(self) -> dict[str, str]:
        """Return the real-time factors over the last period and longer windows; empty at first."""
        if self._factor is None:
            return {}
        factors = {"real-time factor": f"{self._factor:.4f}"}
        now, steps = self._reports[-1]
        for window in _WINDOWS:
            if len(self._reports) > window:
                since, before = self._reports[-1 - window]
                factor = (steps - before) * self._drive.step / (now - since)
                factors[f"real-time factor, {window:g} s"] = f"{factor:.5f}"
        return factors

    def _off_pace(self) -> bool:
        """Return whether the real-time factor is beyond tolerance from the requested factor."""
        if self._factor is None or not self.paced:
            return False
        return abs(self._factor / self._pacer.factor - 1.0) > self.tolerance.factor

    def _drift(self) -> list[str]:
        """Return a warning if the estimated error exceeds the requested accuracy."""
        work_precision = self._work_precision
        if self.checks is None or work_precision is None:
            return []
        angle, whirl = self.checks.estimate
        if share_of(work_precision.requested, angle, whirl) <= 1.0:
            return []
        wishes = [
            f"{key} {error:.1e} {unit} (requested {limit:g})"
            for key, error, limit, unit in (
                ("ball angle", angle, work_precision.requested.angle, "rad"),
                ("whirl", whirl, work_precision.requested.whirl, work_precision.unit),
            )
            if limit is not None and error > limit
        ]
        return [
            f"less accurate than requested, error estimate of {', '.join(wishes)}: the step was "
            "chosen for the scene's profile, and this run differs from it; request a smaller "
            "error, or a profile that resembles this run"
        ]

    def _estimates(self) -> dict[str, str]:
        """Return the error estimates; empty without checks."""
        checks = self.checks
        if checks is None:
            return {}
        unit = self._drive.scene.whirl_unit[1]
        return {
            "error estimate, ball angle [rad]": f"{checks.estimate.angle:.2g}",
            f"error estimate, whirl [{unit}]": f"{checks.estimate.whirl:.2g}",
            "largest error estimate, ball angle [rad]": f"{checks.largest.angle:.2g}",
            f"largest error estimate, whirl [{unit}]": f"{checks.largest.whirl:.2g}",
            "error checks' share of work": f"{checks.share:.4f}",
            "steps checked": str(checks.checked),
        }


class NewWarnings:
    """Selects the new warnings in each report; two that differ only in numbers are the same."""

    def __init__(self) -> None:
        self._seen: dict[str, float] = {}
        """Time of the last report that contained each warning [s], by text without numbers."""

    def of(self, warnings: Iterable[str], now: float) -> list[str]:
        """Return the warnings that no report of the last ``ABSENT`` seconds contained.

        Parameters
        ----------
        warnings
            All warnings of the present report.
        now
            Present time [s].
        """
        present = {NUMBER.sub("#", warning): warning for warning in warnings}
        new = [w for key, w in present.items() if now - self._seen.get(key, -math.inf) > ABSENT]
        recent = {key: time for key, time in self._seen.items() if now - time <= ABSENT}
        self._seen = recent | dict.fromkeys(present, now)
        return new
