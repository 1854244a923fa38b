"""The adaptive start-up of a drive: inputs of its controller, their times, and its decisions."""

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from ab_sim.base.errors import NOT_AS_WRITTEN, SceneError
from ab_sim.base.numbers import reason_of
from ab_sim.control import SensorFacts, StartUp, StartUpSettings, State
from ab_sim.control.settings import Quantity
from ab_sim.drive.controller import TimedDecision, stamped_time
from ab_sim.drive.faults.fault import SPINDLE, Fault
from ab_sim.drive.faults.sensed import SensedFaults
from ab_sim.drive.sensing import digits, noise_variance
from ab_sim.drive.trajectory import Trajectory, taken
from ab_sim.scene.model import Scene
from ab_sim.scene.profiles import AdaptiveProfile
from ab_sim.scene.sensors import steps_per_sample


def settings_of(scene: Scene) -> StartUpSettings:
    """Return the settings of the controller of a scene's adaptive start-up.

    Raises:
        SceneError: the scene's profile is of another kind.
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
    # A clipped reading does not show how large the vibration is.
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


class AdaptiveController:
    """Controller of a drive's adaptive start-up, between sensors and commands (``RunController``).

    Until it has received the sample of the sensor's first period it commands nothing, like the
    controller of a live drive in lock step.

    Args:
        scene: scene with an adaptive profile.
        faults: faults of the drive; those of the sensor and of the spindle's speed alter the input.
    """

    def __init__(self, scene: Scene, faults: Iterable[Fault] = ()) -> None:
        profile, step = scene.profile, scene.solver.step
        self.start_up = StartUp(settings_of(scene))
        assert isinstance(profile, AdaptiveProfile)
        self.decisions: list[TimedDecision] = []
        self.aborted: TimedDecision | None = None
        self.history: list[EstimatesAt] = []
        """Estimates at each command so far."""
        self._decided = 0
        self._sensor, self._inputs = profile.sensor, {profile.sensor, SPINDLE}
        self._step_ns = round(step * 1e9)
        self._per_command = profile.steps_per_command(step)
        self._per_sample = steps_per_sample(scene.pickups[profile.sensor].sample_rate, step)
        self._faults = SensedFaults(faults, scene)

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

    def next(self, step: int) -> int:
        """Return the step of the next command; see ``RunController``."""
        return step - step % self._per_command + self._per_command

    def command(self, newest: Trajectory, step: int) -> float | None:
        """Return the command of a step; see ``RunController``."""
        if len(newest):
            self._receive(newest)
        return None if step % self._per_command else self._decide(stamped_time(step, self._step_ns))

    def _receive(self, run: Trajectory) -> None:
        rows, at = taken(run, self._per_sample), run.channels.index
        steps = rows[:, 0].astype(np.int64)
        first = at(f"{self._sensor}_1")
        readings = self._faults.altered(self._sensor, rows[:, first : first + 2].T, steps)
        speed = self._faults.altered(SPINDLE, rows[:, at("speed")], steps)
        columns = np.column_stack((rows[:, at("angle")], speed, readings.T))
        for step, row in zip(steps.tolist(), columns.tolist(), strict=True):
            if not self._faults.silent(step) & self._inputs:
                self.start_up.sample(stamped_time(step, self._step_ns), *row)

    def _decide(self, time: float) -> float | None:
        start_up = self.start_up
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
