"""Drive and profile controller in lock step: a period, a command, a period, and so on."""

from pathlib import Path

import numpy as np

from ab_msgs_py import topics
from ab_msgs_py.samples import text_of
from ab_sim.drive.trajectory import Trajectory
from tests.nodes.fleet import Fleet

PERIOD = 5
"""Time between two commands [ms]."""


class LockStep:
    """Drive of a scene with its profile controller; by default it wakes up each millisecond.

    Parameters
    ----------
    fleet
        Fleet that runs the nodes.
    scene
        Name or file of the scene.
    profile
        Profile of the controller; default: that of the scene.
    wake_rate
        Wake-ups of the drive per second; a whole number of them must make a period.
    """

    def __init__(
        self, fleet: Fleet, scene: str | Path, profile: str = "", wake_rate: float = 1000.0
    ) -> None:
        self.fleet = fleet
        self.blocks = fleet.listen(topics.BLOCK)
        self._status = fleet.listen(topics.PROFILE_STATUS)
        self._commands = fleet.listen(topics.COMMAND)
        self._trajectories = fleet.listen(topics.TRAJECTORY)
        self._awaited = 0
        fleet.start(
            "drive_sim", scene=scene, time_mode="lock_step", wake_rate=wake_rate, block_rate=200.0,
            steps=round(1e-3 * PERIOD * wake_rate), error_checks=0.0,
        )  # fmt: skip
        fleet.start("profile_controller", profile=f'"{profile or scene}"', use_sim_time=True)
        fleet.until(lambda: fleet.value("profile_controller", "listeners") == "2", "it is heard")

    @property
    def statuses(self) -> list[str]:
        """Return all statuses of the controller."""
        return [text_of(message) for message in self._status]

    @property
    def status(self) -> str:
        """Return the newest status of the controller."""
        return self.statuses[-1]

    def done(self, service: str) -> str:
        """Call a Trigger service, which must succeed; return its text."""
        well, text = self.fleet.call(service)
        assert well, f"{service}: {text}"
        return text

    def step(self, commands: int) -> None:
        """Advance by one period after a number of commands; wait for the next command.

        A busy machine may take longer than the drive waits for commands, so the call is repeated.
        """
        if commands != self._awaited:
            self._awaited = commands
            assert self.fleet.set("drive_sim", await_commands=commands)[0]
        before = len(self._commands)
        for _ in range(20):
            if (answer := self.fleet.call("drive_sim/step"))[0]:
                break
        assert answer[0], answer
        self.fleet.until(
            lambda: len(self._commands) > before or self._trajectories,
            "a command after it, unless a trajectory stands for all of them",
        )

    def samples(self) -> Trajectory:
        """Return all samples of the drive so far, in whole blocks."""
        each = [topics.BLOCK.sample(message) for message in self.blocks]
        return Trajectory(each[0].channels, np.concatenate([block.samples for block in each]))
