"""Drive that follows the orders of a command path; no ROS."""

from collections.abc import Iterator

from ab_sim.drive import Drive
from ab_sim.drive.accuracy.live_checks import LiveChecks
from ab_sim.drive.faults.active import ActiveFaults
from ab_sim.drive.observation import Snapshot
from ab_sim.drive.trajectory import Trajectory
from ab_sim.nodes.command_path import CommandPath, TrajectoryOrder

SLICE = 1000
"""Largest number of steps between two checks for orders, such as an emergency stop."""


class CommandedDrive:
    """Advances a drive, and applies each order and fault at its step.

    Args:
        drive: drive; only this object may command it.
        path: source of the orders.
        checks: error checks of the drive; None: no checks.
        faults: faults of the drive.
    """

    def __init__(
        self,
        drive: Drive,
        path: CommandPath,
        checks: LiveChecks | None = None,
        faults: ActiveFaults | None = None,
    ) -> None:
        self.drive, self.path = drive, path
        self.faults = faults or ActiveFaults(drive)
        self.checks: LiveChecks | None
        self._stepped: Drive | LiveChecks
        self.set_checks(checks)

    def advance(self, steps: int) -> Iterator[Trajectory]:
        """Take integration steps, and yield their trajectories in parts.

        Raises:
            DivergedError: see ``Drive.advance``.
        """
        end = self.drive.steps + steps
        while self.drive.steps < end:
            if (jerked := self.faults.jerk(self.drive)) is not None:
                self.restore(jerked)
            self._apply_orders()
            now = self.drive.steps
            until = min(end, now + SLICE, self.path.next(now), self.faults.next(now))
            yield self._stepped.advance(int(until) - self.drive.steps)

    def reset(self) -> None:
        """Reset to t = 0 and the scene's start.

        Commands on the bus are dropped. Faults are kept.
        """
        self._stepped.reset()
        self.path.reset()
        self.faults.begin_anew(0)

    def reset_time(self) -> None:
        """Set the time to 0 in the present state; commands remain in force."""
        kept = self.drive.snapshot()
        self.path.count_from(self.drive.steps, 0)
        self.faults.count_from(self.drive.steps, 0)
        self.restore(kept._replace(steps=0, profile=kept.profile.moved(-self.drive.time)))

    def reset_state(self) -> None:
        """Reset the state to the scene's start, and keep the time; drop commands on the bus."""
        steps, time = self.drive.steps, self.drive.time
        self.reset()
        self.faults.begin_anew(steps)
        start = self.drive.snapshot()
        self.restore(start._replace(steps=steps, profile=start.profile.moved(time)))

    def restore(self, to: Snapshot) -> None:
        """Continue from a snapshot, and restart the error checks."""
        self.drive.restore(to)
        if self.checks is not None:
            self.checks.begin_anew()

    def set_checks(self, checks: LiveChecks | None) -> None:
        """Replace the error checks; None: no checks."""
        self.checks = checks
        self._stepped = checks or self.drive

    def _apply_orders(self) -> None:
        def speed() -> float:
            return self.drive.observe().omega

        while (order := self.path.order(self.drive.steps, speed)) is not None:
            if isinstance(order, TrajectoryOrder):
                self._stepped.follow(*order)
            else:
                self._stepped.command(*order)
