"""Run a recorded run again offline, with the same commands at the same times."""

import math

import numpy as np

from ab_sim.analysis.start_state import start_from
from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory
from ab_sim.errors import CommandError, InputError, exact
from ab_sim.scene.load import changed_scene
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
    return ReplayedDrive(Drive(scene, commanded=True)).at_steps(steps, commands)


class ReplayedDrive:
    """A drive that is commanded as a recording says, a part of the recording at a time.

    Args:
        drive: at its start, which is where the recording begins.
        first: the recorded step, or with ``at_times`` the time [s], at which it begins.
        obeys: whether it is commanded; else it follows its profile, whatever the commands are.
    """

    def __init__(self, drive: Drive, first: float = 0.0, obeys: bool = True) -> None:
        self.drive = drive
        self._first, self._obeys = first, obeys
        self._command = float(drive.present()["command"][0])
        self._last = drive.present()

    def at_steps(self, steps: np.ndarray, commands: np.ndarray) -> Trajectory:
        """The drive at recorded steps, to the bit what it was if it was this drive.

        Args:
            steps: rising, of samples that follow those given before; shape (samples,).
            commands: the command in force during the step that ends at each [rad/s]. Where steps
                are left out, one that changed meanwhile acts as late as it may.

        Raises:
            InputError: the drive refuses a command; names it, and its step.
            DivergedError: see ``Drive.advance``.
        """
        own = (steps - self._first).astype(np.int64)
        run = self._run(own - 1, commands, int(own[-1]))
        return Trajectory(run.channels, run.samples[own - int(run["step"][0])])

    def at_times(self, times: np.ndarray, commands: np.ndarray) -> Trajectory:
        """The drive at recorded times, between two of its steps on the straight line between them.

        Args:
            times: rising [s], of samples that follow those given before; shape (samples,).
            commands: what is commanded from each of these times on [rad/s], which the drive obeys
                from the nearest of its steps on; NaN: nothing.

        Raises:
            InputError, DivergedError: as ``at_steps``.
        """
        since = times - self._first
        nearest = np.rint(since / self.drive.step).astype(np.int64)
        run = self._run(nearest, commands, math.ceil(since[-1] / self.drive.step - 1e-9))
        columns = [np.interp(since, run["time"], column) for column in run.samples.T]
        return Trajectory(run.channels, np.column_stack(columns))

    def _run(self, steps: np.ndarray, commands: np.ndarray, until: int) -> Trajectory:
        """Obey commands from these steps on; the present, and every step until the last."""
        drive, parts = self.drive, [self._last]
        # Where there is none, the last one holds.
        held = np.maximum.accumulate(np.where(np.isnan(commands), -1, np.arange(len(commands))))
        known = np.where(held < 0, self._command, commands[held])
        changes = np.flatnonzero(np.diff(known, prepend=self._command)).tolist()
        for change in changes if self._obeys else ():
            parts.append(drive.advance(max(int(steps[change]) - drive.steps, 0)))
            try:
                drive.command(float(known[change]))
            except CommandError as error:
                raise InputError(f"step {drive.steps} of the recording: {error}") from error
        parts.append(drive.advance(max(until - drive.steps, 0)))
        self._command = float(known[-1])
        run = Trajectory.join(parts)
        self._last = run.last(1)
        return run


def scene_from(scene: Scene, sample: dict[str, float]) -> Scene:
    """The scene, begun in a state that was recorded, led by commands only.

    Args:
        scene: with the deck and as many balls as the sample is of.
        sample: a value for each channel.

    Raises:
        InputError: the sample shows no whole state; says what to do.
    """
    try:
        start = start_from(sample, scene.balls.count, scene.deck is not None)
    except InputError as error:
        raise InputError(
            f"the recording begins at t = {exact(sample['time'])} s, after its run's start, and "
            f"{error}: give a recording that begins at step 0"
        ) from error
    changes = {"profile": None, **{f"start.{key}": value for key, value in start.items()}}
    return changed_scene(scene, changes, "state recorded first")
