"""Controllers of drives whose profile depends on measurements during the run."""

import copy
import math
from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from ab_sim.base.errors import NOT_AS_WRITTEN, SceneError
from ab_sim.base.numbers import reason_of
from ab_sim.base.sample_columns import STEP
from ab_sim.control import SensorFacts, StartUp, StartUpSettings, State
from ab_sim.control.settings import Quantity
from ab_sim.drive.faults.fault import SPINDLE, VIBRATION, Fault, SensedFaults
from ab_sim.drive.observation import Snapshot
from ab_sim.drive.pickup import digits, noise_variance
from ab_sim.drive.trajectory import Trajectory, taken
from ab_sim.model.spindle.profile_run import ProfileRun, ProfileState
from ab_sim.model.spindle.schedule import SpeedSchedule
from ab_sim.model.spindle.segments_execution import PERIOD, SILENCE, SegmentsExecution
from ab_sim.scene.load import RequestedProfile
from ab_sim.scene.model import Scene
from ab_sim.scene.profiles import AdaptiveProfile
from ab_sim.scene.sensors import steps_per_sample


class TimedDecision(NamedTuple):
    """Decision of a controller during a run, and its time."""

    time: float
    """Time [s]."""
    text: str
    """Action that begins at ``time``, and the reason for the action, in words for users."""


class RunController(ABC):
    """Controller that receives sensor readings, faults included, and commands the drive.

    ``command`` is called every period from t = 0 on, with all samples up to and including that
    instant.

    Parameters
    ----------
    scene
        Scene whose profile depends on measurements.
    period
        Number of steps from one command to the next.
    faults
        Faults of the drive; those of sensors alter the input.
    """

    def __init__(self, scene: Scene, period: int, faults: Iterable[Fault]) -> None:
        self.decisions: list[TimedDecision] = []
        """Decisions of the controller since the start of the run, in order of time."""
        self.aborted: TimedDecision | None = None
        """Decision to ramp down, with the reason; None while the run is not aborted."""
        self._step_ns = round(scene.solver.step * 1e9)
        self._per_command = period
        self._faults = SensedFaults(faults, scene)

    @property
    @abstractmethod
    def state(self) -> Any:
        """Return the complete state as JSON-able values."""

    @abstractmethod
    def restore(self, state: Any) -> None:
        """Continue from a state of a controller of the same scene.

        Raises
        ------
        ValueError
            The state is not valid.
        """

    def next(self, step: int) -> int:
        """Return the first step after ``step`` at which a command is due."""
        return step - step % self._per_command + self._per_command

    def command(self, newest: Trajectory, step: int) -> float | None:
        """Return the speed to command at a step [rad/s]; None if no command is due or ready.

        Parameters
        ----------
        newest
            All steps since the last call, this one included; empty at the start.
        step
            The present step.
        """
        if len(newest):
            self._receive(newest)
        return None if step % self._per_command else self._decide(step)

    @abstractmethod
    def _receive(self, newest: Trajectory) -> None:
        """Process the samples of new steps."""

    @abstractmethod
    def _decide(self, step: int) -> float | None:
        """Return the speed to command at a step [rad/s]; None for no command."""

    def _time_of(self, step: int) -> float:
        """Return the time of a step [s], bit-identical to the time from a stamp in nanoseconds."""
        return step * self._step_ns * 1e-9


def settings_of(scene: Scene) -> StartUpSettings:
    """Return the settings of the controller of a scene's adaptive start-up.

    Raises
    ------
    SceneError
        The scene's profile is of another kind.
    """
    profile = scene.profile
    if not isinstance(profile, AdaptiveProfile):
        has = "none" if profile is None else profile.kind
        raise SceneError(f"{scene.name}: profile.kind = {has}: must be adaptive")
    sensor = scene.pickups[profile.sensor]
    # With an accuracy instead of a step, the sample period stands in; the noise hardly depends on
    # it.
    step = scene.solver.step if scene.accuracy is None else 1.0 / sensor.sample_rate
    noise = math.sqrt(noise_variance(sensor, step))
    turned = math.remainder(sensor.axis_angle, 2.0 * math.pi)
    most = float(digits(sensor, np.array(sensor.range)))
    # A reading at the end of the range may be clipped and hide a larger vibration. The largest
    # reading that counts as valid is therefore the number just below.
    quantity: Quantity = "displacement" if profile.sensor in scene.probes else "acceleration"
    return profile.settings(SensorFacts(quantity, 2, turned, noise), math.nextafter(most, 0.0))


class EstimatesAt(NamedTuple):
    """Action and estimates of the controller after a command; NaN while an estimate is unknown."""

    time: float
    """Time [s]."""
    state: State
    critical_speed: float
    critical_speed_deviation: float
    """Critical speed and its standard deviation [rad/s]."""
    net_unbalance: float
    net_unbalance_deviation: float
    """Eccentricity of the rotor's centre of mass, balls included, and its standard deviation
    [m]."""


class AdaptiveController(RunController):
    """Controller of a drive's adaptive start-up.

    Like the controller of a live drive in lock step, it commands nothing before it has received the
    sample at the end of the sensor's first period.

    Parameters
    ----------
    scene
        Scene with an adaptive profile.
    faults
        Faults of the drive; those of the sensor and of the spindle's speed alter the input.
    """

    def __init__(self, scene: Scene, faults: Iterable[Fault] = ()) -> None:
        profile, step = scene.profile, scene.solver.step
        self.start_up = StartUp(settings_of(scene))
        assert isinstance(profile, AdaptiveProfile)
        super().__init__(scene, profile.steps_per_command(step), faults)
        self.history: list[EstimatesAt] = []
        """Estimates of the drive's parameters at each command of the run so far."""
        self._decided = 0
        self._sensor, self._inputs = profile.sensor, {profile.sensor, SPINDLE}
        self._per_sample = steps_per_sample(scene.pickups[profile.sensor].sample_rate, step)

    @property
    def state(self) -> tuple[float, ...]:
        """Return the state; see ``RunController``."""
        return self.start_up.state_numbers()

    def restore(self, state: Any) -> None:
        """Restore a state; see ``RunController``."""
        try:
            self.start_up.restore(tuple(map(float, state)))
        except NOT_AS_WRITTEN as error:
            raise ValueError(f"no state of an adaptive start-up: {reason_of(error)}") from error
        self._decided, self.aborted = self.start_up.decision.number, None

    def _receive(self, newest: Trajectory) -> None:
        """Pass the sensor's samples in a run to the controller, with the effect of faults."""
        rows, at = taken(newest, self._per_sample), newest.channels.index
        steps = rows[:, STEP].astype(np.int64)
        first = at(f"{self._sensor}_1")
        readings = self._faults.altered(self._sensor, rows[:, first : first + 2].T, steps)
        speed = self._faults.altered(SPINDLE, rows[:, at("speed")], steps)
        columns = np.column_stack((rows[:, at("angle")], speed, readings.T))
        for step, row in zip(steps.tolist(), columns.tolist(), strict=True):
            if not self._faults.silent(step) & self._inputs:
                self.start_up.sample(self._time_of(step), *row)

    def _decide(self, step: int) -> float | None:
        """Let the controller command a speed [rad/s] at a step, and log a new decision."""
        start_up, time = self.start_up, self._time_of(step)
        speed = start_up.command(time)
        if start_up.decision.number != self._decided:
            self._decided = start_up.decision.number
            self.decisions.append(TimedDecision(time, start_up.decision.text))
            if start_up.state is State.ABORTING:
                self.aborted = TimedDecision(time, start_up.reason)
        estimates = start_up.estimates
        self.history.append(
            EstimatesAt(
                time,
                start_up.state,
                *estimates[:2],
                abs(estimates.net_unbalance),
                estimates.net_unbalance_deviation,
            )
        )
        return None if start_up.state is State.WAITING else speed


class SegmentsController(RunController):
    """Controller of the segments of a profile.

    Parameters
    ----------
    scene
        Scene whose profile has a segment that ends on a condition.
    faults
        Faults of the drive; those of sensors alter the input.
    """

    def __init__(self, scene: Scene, faults: Iterable[Fault] = ()) -> None:
        profile, step = scene.profile, scene.solver.step
        if profile is None or profile.kind != "segments":
            raise SceneError(f"{scene.name}: profile: must be of kind segments")
        super().__init__(scene, max(1, round(PERIOD / step)), faults)
        self._time = 0.0
        period, first = self._per_command * step, scene.start.speed
        steepest = SpeedSchedule.of_profile(profile, first).steepest
        self._deceleration = steepest or scene.spindle.max_acceleration
        self._execution = SegmentsExecution(RequestedProfile(profile, first), period, SILENCE)
        self._run = ProfileRun(period, self._say)
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

    def _receive(self, newest: Trajectory) -> None:
        for name, every in (self._sensors or {VIBRATION: 1}).items():
            self._receive_from(name, every, newest)

    def _receive_from(self, name: str, every: int, newest: Trajectory) -> None:
        """Pass one sensor's samples in a run to the profile, with the effect of faults."""
        rows = taken(newest, every)
        channels = ("ax", "ay", "az") if name == VIBRATION else [f"{name}_{k}" for k in (1, 2, 3)]
        index = newest.channels.index
        columns = [index(channel) for channel in channels if channel in newest.channels]
        steps = rows[:, STEP].astype(np.int64)
        steps, readings = self._faults.sampled(name, steps, rows[:, columns])
        for step, vector in zip(steps.tolist(), readings.tolist(), strict=True):
            self._execution.receive(self._time_of(step), name, step * self._step_ns, vector)

    def _decide(self, step: int) -> float | None:
        self._time = self._time_of(step)
        if step:
            return self._run.tick(self._time)
        self._run.start(self._time, self._execution, self._deceleration)
        return self._run.commanded

    def _say(self, status: str, well: bool) -> None:
        """Log a status of the profile as a decision."""
        if status != "idle":
            self.decisions.append(TimedDecision(self._time, status))
            if self._run.state is ProfileState.ABORTING:
                self.aborted = TimedDecision(self._time, self._run.why)


def controller_of(scene: Scene, faults: Iterable[Fault] = ()) -> RunController | None:
    """Return the controller of a drive at its start; None if its profile is known in advance."""
    if not scene.is_controlled:
        return None
    adaptive = isinstance(scene.profile, AdaptiveProfile)
    return AdaptiveController(scene, faults) if adaptive else SegmentsController(scene, faults)


def restored_controller(
    scene: Scene, faults: Iterable[Fault], snapshot: Snapshot
) -> RunController | None:
    """Return the controller of a drive in the state of a snapshot; None if it has none.

    Raises
    ------
    ValueError
        The snapshot belongs to a drive with another profile.
    """
    if snapshot.controller is None:
        return None
    controller = controller_of(scene, faults)
    if controller is None:
        raise ValueError("the snapshot is of a drive with a profile controller, this one has none")
    controller.restore(snapshot.controller)
    return controller
