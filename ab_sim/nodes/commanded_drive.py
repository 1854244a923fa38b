"""A drive that is led by commands along their path; no ROS."""

from collections.abc import Iterator

from ab_sim.accuracy.live_checks import LiveChecks
from ab_sim.drive import Drive
from ab_sim.drive.faults.active import ActiveFaults
from ab_sim.drive.observation import Snapshot
from ab_sim.drive.trajectory import Trajectory
from ab_sim.nodes.command_path import CommandPath


class CommandedDrive:
    """Advances a drive and has it obey, each at its step.

    Args:
        drive: commanded by nobody else.
        path: of the commands.
        checks: of its error, if there are any.
        faults: those of the drive.
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
        self.check_with(checks)

    def advance(self, steps: int) -> Iterator[Trajectory]:
        """Take whole steps; what they give, as it comes.

        Raises:
            DivergedError: as ``Drive.advance``.
        """
        end = self.drive.steps + steps
        while self.drive.steps < end:
            if (leap := self.faults.jerk(self.drive)) is not None:
                self.leap(leap)
            self._obey()
            now = self.drive.steps
            until = min(end, self.path.next(now), self.faults.next(now))
            yield self._stepped.advance(int(until) - self.drive.steps)

    def reset(self) -> None:
        """Back to t = 0 and the scene's start; commands under way are forgotten, faults stay."""
        self._stepped.reset()
        self.path.reset()
        self.faults.begin_anew(0)

    def reset_time(self) -> None:
        """Back to t = 0 in the present state; what was commanded goes on."""
        kept = self.drive.snapshot()
        self.path.count_from(self.drive.steps, 0)
        self.faults.count_from(self.drive.steps, 0)
        self.leap(kept._replace(steps=0, profile=kept.profile.moved(-self.drive.time)))

    def reset_state(self) -> None:
        """Back to the scene's start, and time goes on; commands under way are forgotten."""
        steps, time = self.drive.steps, self.drive.time
        self.reset()
        self.faults.begin_anew(steps)
        start = self.drive.snapshot()
        self.leap(start._replace(steps=steps, profile=start.profile.moved(time)))

    def leap(self, to: Snapshot) -> None:
        """On to another state and time."""
        self.drive.restore(to)
        if self.checks is not None:
            self.checks.begin_anew()

    def check_with(self, checks: LiveChecks | None) -> None:
        """Have other checks from now on, or none."""
        self.checks = checks
        self._stepped = checks or self.drive

    def _obey(self) -> None:
        order = self.path.order(self.drive.steps, lambda: self.drive.observe().omega)
        if order is not None:
            self._stepped.command(*order)
