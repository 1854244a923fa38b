"""Faults in force while a drive runs: their effects over time, and the altered sensor readings."""

import math
from collections.abc import Set
from typing import NamedTuple

import numpy as np

from ab_sim.base.sample_columns import STEP
from ab_sim.drive.disc import on_other_axes
from ab_sim.drive.drive import Drive
from ab_sim.drive.faults.fault import SPINDLE, VIBRATION, SensedFaults, of_the_plant
from ab_sim.drive.faults.plant import held_balls, stop_held_balls
from ab_sim.drive.observation import Snapshot
from ab_sim.drive.trajectory import Trajectory
from ab_sim.model.dynamics.system import has_motor

_JERK = 0.01
"""Time between two jerks of a slipping disc [s]; rounded to whole steps, at least one."""


class SensorReadings(NamedTuple):
    """Readings of a drive's sensors, with the effect of faults."""

    present: Trajectory
    """Sample with the readings; angles count from the mark of the unbalance on the hub."""
    silent: Set[str]
    """Names of sensors that report nothing at the present step."""


class ActiveFaults:
    """The faults of a running drive.

    A disc that slips by a small angle turns only the unbalance: see ``drive.disc``. Without faults
    there is no cost.

    Parameters
    ----------
    drive
        Drive that was created with the faults.
    before
        Faults of the drive whose motion this one continues; faults in both keep their start.
    """

    def __init__(self, drive: Drive, before: "ActiveFaults | None" = None) -> None:
        self.faults, self._scene, self._step = drive.faults, drive.scene, drive.step
        self._sensed = SensedFaults(self.faults, drive.scene)
        self._rate = next((f.size or 0.0 for f in self.faults if f.verb == "slips"), 0.0)
        self._channels = {SPINDLE: ("speed",), VIBRATION: ("ax", "ay", "az")}
        if self._scene.sensors:
            del self._channels[VIBRATION]
        pickups = self._scene.pickups
        self._channels |= {name: (f"{name}_1", f"{name}_2", f"{name}_3") for name in pickups}
        self._every = max(1, round(_JERK / self._step))
        self.slipped = 0.0
        """Angle by which the disc lags behind the hub [rad]."""
        self._jerked = 0
        self.restart(drive.steps)
        if before is not None:
            self._sensed.keep_starts_of(before._sensed)
            if self._rate and before._rate:
                self.slipped, self._jerked = before.slipped, before._jerked

    @property
    def lost(self) -> list[int]:
        """Return the numbers of the lost balls."""
        return held_balls(fault for fault in self.faults if fault.verb == "lost")

    def restart(self, now: int) -> None:
        """Restart all faults at step ``now``, with the disc in its initial angle on the hub."""
        self.slipped, self._jerked = 0.0, now
        self._sensed.restart(now)

    def count_from(self, now: int, then: int) -> None:
        """Keep all faults as they are when the drive's step ``now`` is renumbered as ``then``."""
        self._jerked += then - now
        self._sensed.count_from(now, then)

    def next(self, now: int) -> float:
        """Return the first step after ``now`` at which the disc jerks; infinity if never."""
        return now - now % self._every + self._every if self._rate else math.inf

    def jerk(self, drive: Drive) -> Snapshot | None:
        """Return the drive's state after a jerk of the disc at this step; None without a jerk."""
        if not self._rate or drive.steps % self._every or drive.steps <= self._jerked:
            return None
        by = self._rate * (drive.steps - self._jerked) * self._step
        self._jerked = drive.steps
        self.slipped += by
        return on_other_axes(drive.system, -by)(drive.snapshot())

    def readings(self, present: Trajectory) -> SensorReadings:
        """Return a sample with the readings of the sensors, altered by faults."""
        if not self.faults:
            return SensorReadings(present, frozenset())
        samples, channels = present.samples.copy(), present.channels
        at, step = {name: k for k, name in enumerate(channels)}, samples[:, STEP].astype(int)
        samples[:, at["angle"]] += self.slipped
        for ball in range(self._scene.balls.count):
            samples[:, at[f"ball_{ball}_angle"]] -= self.slipped
        for name, columns_of_sensor in self._channels.items():
            columns = [at[channel] for channel in columns_of_sensor if channel in at]
            samples[:, columns] = self._sensed.altered(name, samples[:, columns].T, step).T
        return SensorReadings(Trajectory(channels, samples), self._sensed.silent(int(step[0])))

    def sampled(
        self, name: str, steps: np.ndarray, readings: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the readings of one sensor at several steps: see ``SensedFaults.sampled``."""
        return self._sensed.sampled(name, steps, readings)


def transfer_faults(drive: Drive, other: Drive, before: ActiveFaults) -> ActiveFaults:
    """Continue the motion of a drive in another one of the same scene with other faults.

    Three changes cause jumps. A ball that sticks from now on stops at once and passes its momentum
    to the rest (``plant.stop_held_balls``), while a lost ball takes its momentum along. A ball that
    was stuck or lost becomes free at its last position and at the race's speed. A disc that has
    slipped returns to its place.

    Parameters
    ----------
    drive
        Drive whose motion continues.
    other
        Drive with the new faults, which gets the state.
    before
        Faults in force in ``drive``.

    Returns
    -------
    ActiveFaults
        The faults of the other drive.
    """
    kept = drive.snapshot()
    if before.slipped and not any(fault.verb == "slips" for fault in other.faults):
        kept = on_other_axes(drive.system, before.slipped)(kept)
    if set(of_the_plant(drive.faults)) != set(of_the_plant(other.faults)):
        state, discrete_state = kept.state.copy(), kept.discrete_state.copy()
        state[other.layout.rates][ActiveFaults(other).lost] = 0.0
        psi = kept.schedule.angle(kept.steps * kept.step)
        if has_motor(other.system.effects):
            psi = float(state[other.layout.spindle][0])
        stop_held_balls(other.system, state, discrete_state, held_balls(other.faults), psi)
        # The stepper's memory belongs to other constants.
        kept = kept._replace(state=state, discrete_state=discrete_state, memory=np.empty(0))
    other.restore(kept)
    return ActiveFaults(other, before)
