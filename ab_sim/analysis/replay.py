"""Run a recorded run again offline, with the same commands at the same steps."""

import numpy as np

from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory
from ab_sim.errors import InputError
from ab_sim.scene.model import Scene


def replay(scene: Scene, recorded: Trajectory) -> Trajectory:
    """The run that the recorded commands give, bit for bit what a sound recording holds.

    Args:
        scene: the recorded run's scene.
        recorded: consecutive samples of a commanded drive, from step 0 on.

    Raises:
        InputError: samples are missing, so the commands' steps are not known.
    """
    steps, commands = recorded["step"], recorded["command"]
    if len(steps) == 0 or steps[0] != 0 or np.any(np.diff(steps) != 1):
        raise InputError("the recording does not hold every step from 0 on; it cannot be replayed")
    drive = Drive(scene, commanded=True)
    parts = [drive.present()]
    # A sample carries the command in force during the step that it ends.
    for change in np.flatnonzero(np.diff(commands)).tolist():
        parts.append(drive.advance(change - drive.steps))
        drive.command(commands[change + 1])
    parts.append(drive.advance(len(steps) - 1 - drive.steps))
    return Trajectory.join(parts)
