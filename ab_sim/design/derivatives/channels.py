"""Derivatives of a run's channels by values of its scene."""

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ab_sim.base.errors import InputError, exact, nearest
from ab_sim.base.presentation import Column, Columns, Presented, ends
from ab_sim.design.batch.run_prepared import run_prepared
from ab_sim.design.derivatives.differences import differentiated, prepared_runs, with_stepper
from ab_sim.design.derivatives.keys import checked_keys
from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory, check_room, column_of
from ab_sim.drive.units import unit_of
from ab_sim.engine.stepping.fixed_step import ANGLE
from ab_sim.scene.load import SceneLike, as_scene
from ab_sim.scene.model import Scene

RUNS_PER_KEY = 4


@dataclass(frozen=True, repr=False)
class Sensitivities(Presented):
    """Derivatives of a run's channels by values of its scene; see ``ab_sim.sensitivities``."""

    _rows = 0

    scene: Scene
    """Scene as it was run."""
    trajectory: Trajectory
    """Run of the scene: every integration step, the start included."""
    keys: tuple[str, ...]
    """Keys of the scene."""
    values: np.ndarray
    """Values of the keys, shape (keys,)."""
    key_units: tuple[str, ...]
    """Units of the keys, SI."""
    channels: tuple[str, ...]
    """Channels of the trajectory."""
    steps: np.ndarray
    """Numbers of the samples, shape (samples,)."""
    derivatives: np.ndarray
    """d channel / d key at each sample, SI, shape (channels, keys, samples)."""
    uncertainties: np.ndarray
    """Uncertainties of the derivatives, same shape."""

    @property
    def times(self) -> np.ndarray:
        """Times of the samples [s]."""
        return np.asarray(self.trajectory["time"][self.steps])

    def of(self, channel: str, key: str) -> np.ndarray:
        """Return d channel / d key, shape (samples,).

        Raises:
            InputError: the channel or the key is unknown; the message lists the known ones.
        """
        if channel not in self.channels:
            raise _not_among("channel", channel, self.channels)
        if key not in self.keys:
            raise _not_among("key", key, self.keys)
        derivative: np.ndarray = self.derivatives[
            self.channels.index(channel), self.keys.index(key)
        ]
        return derivative

    def _facts(self) -> dict[str, str]:
        return {
            "scene": self.scene.name,
            "keys": ", ".join(self.keys),
            "channels": str(len(self.channels)),
            "samples": str(len(self.steps)),
            "time": ends(self.times[0], self.times[-1], "s"),
        }

    def _columns(self) -> Columns:
        columns = {"time": Column("s", self.times)}
        for i, channel in enumerate(self.channels):
            for k, key in enumerate(self.keys):
                unit = f"({unit_of(channel)})/({self.key_units[k]})"
                name = f"{channel} by {key}"
                columns[name] = Column(unit, self.derivatives[i, k])
                columns[f"uncertainty of {name}"] = Column(unit, self.uncertainties[i, k])
        return columns


def sensitivities(
    scene: SceneLike,
    keys: Sequence[str],
    *,
    channels: Sequence[str] | None = None,
    times: Sequence[float] | np.ndarray | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Sensitivities:
    """Differentiate channels of a scene's run by values of the scene.

    Derivatives are differences of whole runs, side by side, with their uncertainty.

    Parameters
    ----------
    scene, keys
        See ``metric_sensitivities``.
    channels : sequence of str, optional
        Channels of the trajectory; default: all except ``step``, ``time`` and the sensors'.
    times : sequence of float, optional
        Times [s], increasing and on steps. The run lasts to the last of them. Default: all steps
        until ``scene.duration``.
    progress : callable, optional
        Called with the numbers of finished and of all runs, for each batch of runs.

    Returns
    -------
    Sensitivities
        ``derivatives`` and their ``uncertainties``, shape (channels, keys, samples), SI;
        ``trajectory``, the run with every step; ``times``, ``keys``, ``values``, ``channels``;
        ``of(channel, key)`` returns one derivative.

    Raises
    ------
    InputError
        A key or channel does not exist, a key is not a real number, or a time is not on a step.
    SceneError
        The scene is not valid, or cannot be run with its solver.
    DivergedError
        The state went beyond all bounds.

    Examples
    --------
    >>> import ab_sim
    >>> scene = ab_sim.load_scene("thesis-hold", ["duration=0.1"])
    >>> found = ab_sim.sensitivities(scene, ["balls.mass", "rotor.eccentricity"])
    >>> found.derivatives.shape
    (13, 2, 101)
    >>> found.of("x", "rotor.eccentricity").shape
    (101,)
    """
    scene = as_scene(scene)
    real = checked_keys(scene, keys)
    scene = with_stepper(scene)
    drive = Drive(scene)
    named = _named(scene, drive.channels, channels)
    wanted, steps = _wanted(drive, times)
    try:
        check_room((steps + 1) * (RUNS_PER_KEY * len(keys) + 1), 1, drive.channels)
    except ValueError:
        raise InputError(
            f"{steps} steps are too many to keep for derivatives by {len(keys)} keys: end the run "
            "earlier (duration, times), or request fewer keys"
        ) from None
    run = Trajectory.join([drive.present(), drive.advance(steps)])
    columns = [column_of(name, drive.channels) for name in named]
    here = run.samples[wanted][:, columns].T
    angles = [name == "angle" or name.endswith("_angle") for name in named]
    # Take at least one step, because a scene's duration must be above 0.
    shorter = scene.model_copy(update={"duration": max(steps, 1) * drive.step})

    def results(scenes: Sequence[Scene]) -> np.ndarray:
        prepared = prepared_runs(scenes)
        done = run_prepared(list(prepared.values()), 1, progress)
        results = np.full((len(scenes), *here.shape), np.nan)
        for number, run in zip(prepared, done.runs, strict=True):
            if not run.failure:
                start = Drive(run.scene).present().samples
                samples = np.vstack([start, run.trajectory.samples])
                results[number] = samples[wanted][:, columns].T
        # A start angle moved across pi is wrapped to -pi: undo whole turns in all its samples.
        turns = np.round((results[:, angles, :1] - here[angles, :1]) / (2.0 * math.pi))
        results[:, angles] -= 2.0 * math.pi * turns
        return results

    estimate = differentiated(shorter, real, here, results)
    return Sensitivities(
        scene,
        run,
        tuple(keys),
        np.array([value.value for value in real]),
        tuple(value.unit for value in real),
        tuple(named),
        np.array(wanted),
        estimate.derivatives,
        estimate.uncertainties,
    )


def _named(scene: Scene, all_channels: Sequence[str], channels: Sequence[str] | None) -> list[str]:
    """Return the names of channels after a check; default: all except the sensors'."""
    if channels is None:
        axes = 2 if scene.deck is None else 3
        return list(all_channels[ANGLE : len(all_channels) - axes * len(scene.pickups)])
    for name in channels:
        if name not in all_channels[ANGLE:]:
            raise _not_among("channel", name, all_channels[ANGLE:])
    return list(channels)


def _wanted(drive: Drive, times: Sequence[float] | np.ndarray | None) -> tuple[Sequence[int], int]:
    """Return the indices of the requested samples, and the number of the run's steps."""
    if times is None:
        steps = math.ceil(drive.scene.duration / drive.step - 1e-9)
        return range(steps + 1), steps
    indices = []
    for time in times:
        number = round(time / drive.step) if abs(time) <= sys.float_info.max else -1
        if number < 0 or abs(number * drive.step - time) > 1e-6 * drive.step:
            raise InputError(
                f"times: {exact(time)} s: must be a whole number of steps of {drive.step:g} s, "
                "from 0 on"
            )
        indices.append(number)
    if not indices or any(b <= a for a, b in zip(indices, indices[1:], strict=False)):
        raise InputError("times: must be at least one, and rising")
    return indices, indices[-1]


def _not_among(what: str, name: str, all_names: Sequence[str]) -> InputError:
    return InputError(
        f"{what} {name!r}: there is none{nearest(name, all_names)}; there are: "
        + ", ".join(all_names)
    )
