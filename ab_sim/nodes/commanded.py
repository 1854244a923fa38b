"""A drive that is led by commands along their path; no ROS."""

from collections.abc import Iterator

from ab_sim.accuracy.live_checks import LiveChecks
from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory
from ab_sim.nodes.command_path import CommandPath


class Commanded:
    """Advances a drive and has it obey, each at its step.

    Args:
        drive: commanded by nobody else.
        path: of the commands.
        checks: of its error, if there are any.
    """

    def __init__(self, drive: Drive, path: CommandPath, checks: LiveChecks | None = None) -> None:
        self.drive, self.path, self.checks = drive, path, checks
        self._stepped: Drive | LiveChecks = checks or drive

    def advance(self, steps: int) -> Iterator[Trajectory]:
        """Take whole steps; what they give, as it comes.

        Raises:
            DivergedError: as ``Drive.advance``.
        """
        end = self.drive.steps + steps
        while self.drive.steps < end:
            self._obey()
            until = min(end, self.path.next(self.drive.steps))
            yield self._stepped.advance(int(until) - self.drive.steps)

    def reset(self) -> None:
        """Back to t = 0 and the scene's start; commands under way are forgotten."""
        self._stepped.reset()
        self.path.reset()

    def _obey(self) -> None:
        order = self.path.order(self.drive.steps, lambda: self.drive.observe().omega)
        if order is not None:
            self._stepped.command(*order)
