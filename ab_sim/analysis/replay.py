"""Offline repetition of a recorded run, with the recorded commands."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ab_sim.base.errors import CommandError, InputError, exact
from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory, tilt_of
from ab_sim.model.dynamics.deck_models.in_space import angular_velocity
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene


def start_from(sample: Mapping[str, float], balls: int, tilts: bool) -> dict[str, Any]:
    """Return a scene's ``start`` section from a sample.

    A sample does not contain sticking of balls, the integrator of a motor's speed loop, or the
    state of sensor filters.

    Parameters
    ----------
    sample
        Value of each channel, see ``Trajectory``.
    balls
        Number of balls.
    tilts
        Whether the deck moves in space; its sample then has tilt and height as well.

    Raises
    ------
    InputError
        A channel is missing or not finite; the message names it.
    """
    position, velocity = (["x", "y"], ["vx", "vy"])
    turn, turning = ["qw", "qx", "qy", "qz"], ["wx", "wy", "wz"]
    needed = ["angle", "speed", *position, *velocity]
    if tilts:
        position, velocity = [*position, "z"], [*velocity, "vz"]
        needed += ["z", "vz", *turn, *turning]
    needed += [f"ball_{i}_{what}" for i in range(balls) for what in ("angle", "rate")]
    if lacking := [name for name in needed if not math.isfinite(sample.get(name, math.nan))]:
        raise InputError(f"the sample lacks {', '.join(lacking)}")
    deck = {
        "position": [sample[name] for name in position],
        "velocity": [sample[name] for name in velocity],
    }
    if tilts:
        tilt = tilt_of(np.array([sample[name] for name in turn])).tolist()
        # The angular velocity is linear in the rates of the tilt angles: invert this map.
        rates_to_velocity = np.array(
            [angular_velocity(tuple(tilt), tuple(rate)) for rate in np.eye(3)]
        ).T
        rates = np.linalg.solve(rates_to_velocity, [sample[name] for name in turning])
        deck |= {"tilt": tilt, "tilt_rate": rates.tolist()}
    return {
        "angle": sample["angle"],
        "speed": sample["speed"],
        "ball_angles": [sample[f"ball_{i}_angle"] for i in range(balls)],
        "ball_rates": [sample[f"ball_{i}_rate"] for i in range(balls)],
        "deck": deck,
    }


def replay(scene: Scene, recorded: Trajectory) -> Trajectory:
    """Run a scene with recorded commands; the result equals an intact recording bit by bit.

    Parameters
    ----------
    scene
        The recorded run's scene.
    recorded
        Consecutive samples of a commanded drive, from step 0 on.

    Raises
    ------
    InputError
        Samples are missing, so the steps of the commands are unknown.
    """
    steps, commands = recorded["step"], recorded["command"]
    if len(steps) == 0 or steps[0] != 0 or np.any(np.diff(steps) != 1):
        raise InputError("the recording does not hold every step from 0 on; it cannot be replayed")
    return ReplayedDrive(Drive(scene, commanded=True)).at_steps(steps, commands)


class ReplayedDrive:
    """Drive that follows recorded commands, one part of the recording at a time.

    Parameters
    ----------
    drive
        Drive in its initial state, which is the start of the recording.
    first
        Recorded step at the start; with ``at_times`` the recorded time [s].
    obeys
        Whether the drive follows the commands; otherwise it follows its profile.
    start
        Sample at the start; None: the drive's present one.
    """

    def __init__(
        self,
        drive: Drive,
        first: float = 0.0,
        obeys: bool = True,
        start: Trajectory | None = None,
    ) -> None:
        self.drive = drive
        self._first, self._obeys = first, obeys
        self._last = drive.present() if start is None else start
        self._command = float(self._last["command"][0])

    def at_steps(self, steps: np.ndarray, commands: np.ndarray) -> Trajectory:
        """Return samples at recorded steps; bit-identical if the recording is from this drive.

        Parameters
        ----------
        steps
            Rising step numbers of samples after the previous ones, shape (samples,).
        commands
            Command [rad/s] in force during the step that ends at each sample. A command that
            changed between two samples acts as late as possible.

        Raises
        ------
        InputError
            The drive refuses a command; the message contains it and its step.
        DivergedError
            See ``Drive.advance``.
        """
        indices = (steps - self._first).astype(np.int64)
        run = self._run(indices - 1, commands, int(indices[-1]))
        return Trajectory(run.channels, run.samples[indices - int(run["step"][0])])

    def at_times(self, times: np.ndarray, commands: np.ndarray) -> Trajectory:
        """Return samples at recorded times, interpolated linearly between the drive's steps.

        Parameters
        ----------
        times
            Rising times [s] of samples after the previous ones, shape (samples,).
        commands
            Command from each of these times [rad/s], which takes effect at the nearest step; NaN
            keeps the previous command.

        Raises
        ------
        InputError, DivergedError
            As ``at_steps``.
        """
        since = times - self._first
        nearest = np.rint(since / self.drive.step).astype(np.int64)
        run = self._run(nearest, commands, math.ceil(since[-1] / self.drive.step - 1e-9))
        columns = [np.interp(since, run["time"], column) for column in run.samples.T]
        return Trajectory(run.channels, np.column_stack(columns))

    def _run(self, steps: np.ndarray, commands: np.ndarray, until: int) -> Trajectory:
        """Apply commands and return the samples from the previous one to a step.

        Parameters
        ----------
        steps
            Steps before which the commands are given, shape (commands,).
        commands
            Commands [rad/s], same shape; NaN keeps the previous command.
        until
            Step of the last sample.
        """
        drive, parts = self.drive, [self._last]
        # Without a command, the previous one stays in force.
        held = np.maximum.accumulate(np.where(np.isnan(commands), -1, np.arange(len(commands))))
        in_force = np.where(held < 0, self._command, commands[held])
        changes = np.flatnonzero(np.diff(in_force, prepend=self._command)).tolist()
        for change in changes if self._obeys else ():
            parts.append(drive.advance(max(int(steps[change]) - drive.steps, 0)))
            try:
                drive.command(float(in_force[change]))
            except CommandError as error:
                raise InputError(f"step {drive.steps} of the recording: {error}") from error
        parts.append(drive.advance(max(until - drive.steps, 0)))
        self._command = float(in_force[-1])
        run = Trajectory.join(parts)
        self._last = run.last(1)
        return run


def scene_from(scene: Scene, sample: dict[str, float]) -> Scene:
    """Return the scene with a recorded state as its start and without a profile.

    Parameters
    ----------
    scene
        Scene with the deck and the number of balls of the sample.
    sample
        Value of each channel.

    Raises
    ------
    InputError
        The sample does not contain a complete state; the message tells what to do.
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
