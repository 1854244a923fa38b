"""Faults in force while a drive runs: what goes on of them, and what its sensors say meanwhile."""

import math
from collections.abc import Set
from typing import NamedTuple

import numpy as np

from ab_sim.drive.disc import on_other_axes
from ab_sim.drive.drive import Drive
from ab_sim.drive.faults.fault import SPINDLE, VIBRATION, of_the_plant
from ab_sim.drive.faults.plant import held_balls, jam
from ab_sim.drive.faults.sensed import SensedFaults
from ab_sim.drive.observation import Snapshot
from ab_sim.drive.trajectory import Trajectory
from ab_sim.dynamics.system import has_motor

JERK = 0.01
"""s between two jerks of a disc that slips; whole steps, at least one."""


class SensorReadings(NamedTuple):
    """What sensors say of a drive."""

    present: Trajectory
    """A sample with their readings, and angles from where the hub shows the unbalance."""
    silent: Set[str]
    """Sensors that say nothing this time."""


class ActiveFaults:
    """A drive's faults while it runs.

    A disc that slips by a small angle takes the unbalance along, and nothing else moves: see
    ``drive.disc``. What has no faults costs nothing.

    Args:
        drive: made with them.
        before: of the drive whose motion this one takes over: faults in both go on.
    """

    def __init__(self, drive: Drive, before: "ActiveFaults | None" = None) -> None:
        self.faults, self._scene, self._step = drive.faults, drive.scene, drive.step
        self._sensed = SensedFaults(self.faults, drive.scene)
        self._rate = next((f.size or 0.0 for f in self.faults if f.ails == "slips"), 0.0)
        self._channels = {SPINDLE: ("speed",), VIBRATION: ("ax", "ay", "az")}
        if self._scene.sensors:
            del self._channels[VIBRATION]
        own = self._scene.pickups
        self._channels |= {name: (f"{name}_1", f"{name}_2", f"{name}_3") for name in own}
        self._every = max(1, round(JERK / self._step))
        self.slipped = 0.0
        """By what the disc has fallen behind the hub [rad]."""
        self._jerked = 0
        self.begin_anew(drive.steps)
        if before is not None:
            self._sensed.go_on(before._sensed)
            if self._rate and before._rate:
                self.slipped, self._jerked = before.slipped, before._jerked

    @property
    def lost(self) -> list[int]:
        """Balls that are not there."""
        return held_balls(fault for fault in self.faults if fault.ails == "lost")

    def begin_anew(self, now: int) -> None:
        """As if they had all come at this step; the disc sits where it should."""
        self.slipped, self._jerked = 0.0, now
        self._sensed.begin_anew(now)

    def count_from(self, now: int, then: int) -> None:
        """What was step ``now`` is step ``then``."""
        self._jerked += then - now
        self._sensed.count_from(now, then)

    def next(self, now: int) -> float:
        """The first step after ``now`` at which the disc slips; infinite where it does not."""
        return now - now % self._every + self._every if self._rate else math.inf

    def jerk(self, drive: Drive) -> Snapshot | None:
        """Where to the drive has to leap now; None: it has not."""
        if not self._rate or drive.steps % self._every or drive.steps <= self._jerked:
            return None
        by = self._rate * (drive.steps - self._jerked) * self._step
        self._jerked = drive.steps
        self.slipped += by
        return on_other_axes(drive.system, -by)(drive.snapshot())

    def readings(self, present: Trajectory) -> SensorReadings:
        """What sensors say of one sample; to be asked once for each time that they do."""
        if not self.faults:
            return SensorReadings(present, frozenset())
        samples, channels = present.samples.copy(), present.channels
        at, step = {name: k for k, name in enumerate(channels)}, samples[:, 0].astype(int)
        samples[:, at["angle"]] += self.slipped
        for ball in range(self._scene.balls.count):
            samples[:, at[f"ball_{ball}_angle"]] -= self.slipped
        for name, own in self._channels.items():
            columns = [at[channel] for channel in own if channel in at]
            samples[:, columns] = self._sensed.said(name, samples[:, columns].T, step).T
        return SensorReadings(Trajectory(channels, samples), self._sensed.silent(int(step[0])))

    def sampled(
        self, name: str, steps: np.ndarray, readings: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """What one sensor says of several steps: see ``SensedFaults.sampled``."""
        return self._sensed.sampled(name, steps, readings)


def transfer_faults(drive: Drive, other: Drive, before: ActiveFaults) -> ActiveFaults:
    """Let another drive, of the same scene with other faults, go on from where one is.

    Nothing leaps but this: a ball that sticks from now on stops at once, and its momentum goes to
    what is left (``plant.jam``); one that is lost takes its own along. A ball that was stuck or
    lost is free from where it was, at the race's speed; a disc that has slipped is put back.

    Returns:
        Those faults.
    """
    kept = drive.snapshot()
    if before.slipped and not any(fault.ails == "slips" for fault in other.faults):
        kept = on_other_axes(drive.system, before.slipped)(kept)
    if set(of_the_plant(drive.faults)) != set(of_the_plant(other.faults)):
        state, discrete_state = kept.state.copy(), kept.discrete_state.copy()
        state[other.layout.rates][ActiveFaults(other).lost] = 0.0
        psi = kept.profile.angle(kept.steps * kept.step)
        if has_motor(other.system.effects):
            psi = float(state[other.layout.spindle][0])
        jam(other.system, state, discrete_state, held_balls(other.faults), psi)
        # What a stepper remembers is of other constants.
        kept = kept._replace(state=state, discrete_state=discrete_state, memory=np.empty(0))
    other.restore(kept)
    return ActiveFaults(other, before)
