"""Controller of profiles with segments that end on conditions, as ``profile_controller`` live."""

import copy
from collections.abc import Iterable
from typing import Any

import numpy as np

from ab_sim.base.errors import NOT_AS_WRITTEN, SceneError
from ab_sim.base.numbers import reason_of
from ab_sim.drive.controller import TimedDecision, stamped_time
from ab_sim.drive.faults.fault import VIBRATION, Fault
from ab_sim.drive.faults.sensed import SensedFaults
from ab_sim.drive.trajectory import Trajectory, taken
from ab_sim.model.spindle.profile_run import ProfileRun, ProfileState
from ab_sim.model.spindle.schedule import SpeedSchedule
from ab_sim.model.spindle.segments_execution import PERIOD, SILENCE, SegmentsExecution
from ab_sim.scene.load import RequestedProfile
from ab_sim.scene.model import Scene
from ab_sim.scene.sensors import steps_per_sample


class SegmentsController:
    """Controller of the segments of a profile; see ``RunController``.

    Args:
        scene: scene whose profile has a segment that ends on a condition.
        faults: faults of the drive; those of sensors alter the input.
    """

    def __init__(self, scene: Scene, faults: Iterable[Fault] = ()) -> None:
        profile, step = scene.profile, scene.solver.step
        if profile is None or profile.kind != "segments":
            raise SceneError(f"{scene.name}: profile: must be of kind segments")
        self.decisions: list[TimedDecision] = []
        self.aborted: TimedDecision | None = None
        self._time = 0.0
        self._step_ns = round(step * 1e9)
        self._per_command = max(1, round(PERIOD / step))
        period, first = self._per_command * step, scene.start.speed
        steepest = SpeedSchedule.asked(profile, first).steepest
        self._deceleration = steepest or scene.spindle.max_acceleration
        self._execution = SegmentsExecution(RequestedProfile(profile, first), period, SILENCE)
        self._run = ProfileRun(period, self._say)
        self._faults = SensedFaults(faults, scene)
        rates = {name: sensor.sample_rate for name, sensor in scene.sensors.items()}
        self._sensors = {name: steps_per_sample(rate, step) for name, rate in rates.items()}

    @property
    def state(self) -> Any:
        """Return the state; see ``RunController``."""
        return copy.deepcopy(self._run.state_values())  # the run continues to change its values

    def restore(self, state: Any) -> None:
        """Restore a state; see ``RunController``."""
        try:
            self._run.restore(state, self._execution)
        except NOT_AS_WRITTEN as error:
            raise ValueError(f"no state of a profile: {reason_of(error)}") from error
        self.aborted = None

    def next(self, step: int) -> int:
        """Return the step of the next command; see ``RunController``."""
        return step - step % self._per_command + self._per_command

    def command(self, newest: Trajectory, step: int) -> float | None:
        """Return the command of a step; see ``RunController``."""
        if len(newest):
            for name, every in (self._sensors or {VIBRATION: 1}).items():
                self._receive(newest, name, every)
        if step % self._per_command:
            return None
        self._time = stamped_time(step, self._step_ns)
        if step:
            return self._run.tick(self._time)
        self._run.start(self._time, self._execution, self._deceleration)
        return self._run.commanded

    def _receive(self, run: Trajectory, name: str, every: int) -> None:
        rows = taken(run, every)
        channels = ("ax", "ay", "az") if name == VIBRATION else [f"{name}_{k}" for k in (1, 2, 3)]
        columns = [run.channels.index(channel) for channel in channels if channel in run.channels]
        steps = rows[:, 0].astype(np.int64)
        steps, readings = self._faults.sampled(name, steps, rows[:, columns])
        for step, vector in zip(steps.tolist(), readings.tolist(), strict=True):
            now = stamped_time(step, self._step_ns)
            self._execution.receive(now, name, step * self._step_ns, vector)

    def _say(self, status: str, well: bool) -> None:
        if status != "idle":
            self.decisions.append(TimedDecision(self._time, status))
            if self._run.state is ProfileState.ABORTING:
                self.aborted = TimedDecision(self._time, self._run.why)
