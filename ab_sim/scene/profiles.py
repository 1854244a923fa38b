"""Spindle-speed profiles of scenes, and their checks."""

import math
from collections.abc import Mapping
from typing import Annotated, Literal, get_args

from pydantic import Field, model_validator

from ab_sim.base.errors import InputError, exact, nearest
from ab_sim.control import SensorFacts, StartUpSettings, checked
from ab_sim.scene.quantities import Number, Section, quantity
from ab_sim.scene.segments import KIND, SegmentsProfile
from ab_sim.scene.sensors import RATE_TOLERANCE, Sampled, SensorName

LEAST_SAMPLES = 4
"""Smallest number of samples per turn at the target speed; fewer do not show the whirl's size."""


class RunUp(Section):
    """Common part of profiles that run up to a speed."""

    acceleration: Number = quantity("acceleration of the run-up", "rad/s^2", ge=1e-6, le=1e6)
    target_speed: Number = quantity("final speed", "rad/s", gt=0, le=1e5)


class AdaptiveProfile(RunUp):
    """A start-up that finds the critical speed and dwells automatically (``ab_sim.control``).

    The controller is not given the drive's stiffness or unbalance. It estimates them from a
    sensor's readings, the spindle's angle and its speed. Once per ``command_period`` it commands a
    speed. The commanded speed changes at most at the rate ``acceleration``.
    """

    kind: Literal["adaptive"] = KIND
    sensor: SensorName = quantity(
        "name of the sensor or probe in the scene whose readings the controller gets", "-"
    )
    command_period: Number = quantity(
        "time between two commands, a whole number of steps", "s", ge=1e-4, le=0.1, default=0.005
    )

    def steps_per_command(self, step: float) -> int:
        """Return the number of integration steps of ``step`` [s] between two commands.

        Raises
        ------
        ValueError
            The number is not an integer; the message names the nearest periods that fit.
        """
        steps = self.command_period / step
        whole = max(1, round(steps))
        if abs(steps - whole) <= RATE_TOLERANCE * whole:
            return whole
        below = math.floor(steps)
        nearby = [f"{count * step:.10g}" for count in (below, below + 1) if count]
        raise ValueError(
            f"profile.command_period = {exact(self.command_period)} s: must be a whole number of "
            f"steps of solver.step = {step:g} s; nearest: {' and '.join(nearby)} s"
        )

    def settings(self, sensing: SensorFacts, limit: float = math.inf) -> StartUpSettings:
        """Return the settings of the controller.

        Parameters
        ----------
        sensing
            Properties of the sensor.
        limit
            Largest reading of the sensor, in its unit.
        """
        return StartUpSettings(
            self.target_speed, self.acceleration, sensing, self.command_period, limit=limit
        )

    def check_start(self, first: float) -> None:
        """Check that a run may begin at a speed [rad/s].

        Raises
        ------
        ValueError
            The speed is not allowed; the message names key, value and allowed range.
        """
        try:
            checked(self.settings(SensorFacts("acceleration", 2)))
        except InputError as error:
            raise ValueError(f"profile of kind adaptive: {error}") from error
        # A start speed from a recorded state at the target speed may exceed it by rounding.
        if not 0.0 <= first <= self.target_speed * (1.0 + RATE_TOLERANCE):
            raise ValueError(
                f"start.speed = {exact(first)} rad/s: an adaptive start-up begins between 0 and "
                f"profile.target_speed = {exact(self.target_speed)} rad/s"
            )

    def check_sensors(self, sensors: Mapping[str, Sampled], step: float | None) -> None:
        """Check that a scene's sensors and step suit the controller.

        Parameters
        ----------
        sensors
            Sensors and probes by name.
        step
            Integration step [s]; None if a step that suits the controller is chosen later.

        Raises
        ------
        ValueError
            The sensor is missing or samples too slowly, or the command period is not a whole number
            of steps; the message names key, value and allowed range.
        """
        sensor = sensors.get(self.sensor)
        if sensor is None:
            has = f"has {', '.join(sensors)}" if sensors else "has no sensor"
            raise ValueError(
                f"profile.sensor = {self.sensor!r}: there is no such sensor, the scene {has}"
                f"{nearest(self.sensor, sensors)}; name one, or add it: sensors: {{{self.sensor}: "
                "{}}"
            )
        least = LEAST_SAMPLES * self.target_speed / (2.0 * math.pi)
        if sensor.sample_rate < least:
            raise ValueError(
                f"sample_rate of {self.sensor} = {sensor.sample_rate:.10g} Hz: an adaptive "
                f"start-up needs at least {LEAST_SAMPLES} samples in a turn, {least:.4g} Hz at "
                f"profile.target_speed = {exact(self.target_speed)} rad/s"
            )
        if step is not None:
            self.steps_per_command(step)


class VariableSpeedPeriod(Section):
    """Period near the critical speed with a different acceleration of the spindle."""

    start_speed: Number | None = quantity(
        "speed at which the period begins (give this or start_time)", "rad/s", default=None
    )
    start_time: Number | None = quantity(
        "time at which the period begins (give this or start_speed)",
        "s",
        ge=0,
        le=1e6,
        default=None,
    )
    duration: Number = quantity("duration of the period", "s", ge=1e-6, le=1e4)
    acceleration: Number = quantity(
        "acceleration during the period: 0 holds the speed, negative decelerates",
        "rad/s^2",
        default=0.0,
    )

    @model_validator(mode="after")
    def _one_start(self) -> "VariableSpeedPeriod":
        if (self.start_speed is None) == (self.start_time is None):
            raise ValueError("give exactly one of start_speed and start_time")
        return self


class StartUpProfile(RunUp):
    """Constant acceleration to a target speed, also with a variable-speed period (thesis 3.1).

    The run may begin at any speed; above the target speed, the spindle decelerates at the same
    rate. The target speed is held. A variable-speed period is omitted if the run begins above its
    start speed.
    """

    kind: Literal["start_up"] = KIND
    variable_speed_period: VariableSpeedPeriod | None = None

    def period_begins(self, first: float) -> float | None:
        """Return the speed at which the variable-speed period begins [rad/s].

        Parameters
        ----------
        first
            Speed at which the run begins [rad/s].

        Returns
        -------
        float | None
            None if the profile has no such period, or if the run begins above its start speed or at
            or above the target speed.
        """
        period = self.variable_speed_period
        if period is None or first >= self.target_speed:
            return None
        if period.start_speed is None:
            assert period.start_time is not None
            return first + self.acceleration * period.start_time
        return period.start_speed if period.start_speed >= first else None


class SpeedChangeProfile(Section):
    """A raised-cosine change of speed (relative-stability (25), on [t_b, t_b + t_r] only)."""

    kind: Literal["speed_change"] = KIND
    start_time: Number = quantity("t_b, time at which the change begins", "s", ge=0, le=1e6)
    duration: Number = quantity("t_r, duration of the change", "s", ge=1e-6, le=1e4)
    to_speed: Number = quantity("speed after the change", "rad/s", ge=-1e5, le=1e5)


AnyProfile = StartUpProfile | SpeedChangeProfile | SegmentsProfile | AdaptiveProfile
Profile = Annotated[AnyProfile, Field(discriminator="kind")]
KINDS: tuple[str, ...] = tuple(
    get_args(kind.model_fields["kind"].annotation)[0] for kind in get_args(AnyProfile)
)


def planned(profile: AnyProfile | None) -> AnyProfile | None:
    """Return a profile that is known in advance, without decisions during the run.

    Segments that end on a condition get their longest duration, and an adaptive start-up
    accelerates without a pause.
    """
    if isinstance(profile, SegmentsProfile):
        return profile.lasting
    if isinstance(profile, AdaptiveProfile):
        return StartUpProfile(
            kind="start_up", acceleration=profile.acceleration, target_speed=profile.target_speed
        )
    return profile


def beyond(key: str, speed: float, limit: float) -> str:
    """Return the message for a speed at ``key`` that is beyond the spindle's limit [rad/s]."""
    return (
        f"{key} = {exact(speed)} rad/s: is beyond spindle.max_speed = {exact(limit)} rad/s; lower "
        "it or raise the limit"
    )


def check_profile(
    profile: AnyProfile, first: float, max_speed: float, max_acceleration: float
) -> None:
    """Check that a spindle can follow a profile.

    Parameters
    ----------
    profile
        The profile.
    first
        Speed at which it begins [rad/s].
    max_speed
        Largest speed of the spindle [rad/s]; infinite if unknown.
    max_acceleration
        Largest acceleration of the spindle [rad/s^2]; infinite if unknown.

    Raises
    ------
    ValueError
        A speed or acceleration of the profile is beyond a limit, or the profile cannot begin at
        this speed; the message names key, value, allowed range and remedy.
    """
    if isinstance(profile, SpeedChangeProfile):
        if abs(profile.to_speed) > max_speed:
            raise ValueError(beyond("profile.to_speed", profile.to_speed, max_speed))
    elif isinstance(profile, StartUpProfile):
        _check_start_up(profile, first, max_speed, max_acceleration)
    elif isinstance(profile, AdaptiveProfile):
        _check_target(profile, max_speed, max_acceleration)
        profile.check_start(first)
    else:
        _check_segments(profile, first, max_speed, max_acceleration)


def _check_target(profile: RunUp, max_speed: float, max_acceleration: float) -> None:
    """Refuse a target speed [rad/s] or an acceleration [rad/s^2] beyond the spindle's limits."""
    if profile.target_speed > max_speed:
        raise ValueError(beyond("profile.target_speed", profile.target_speed, max_speed))
    _check_acceleration("profile", profile.acceleration, max_acceleration)


def _check_start_up(
    profile: StartUpProfile, first: float, max_speed: float, max_acceleration: float
) -> None:
    """Refuse a start-up beyond the limits, or with a variable-speed period beyond its speeds."""
    _check_target(profile, max_speed, max_acceleration)
    target, period = profile.target_speed, profile.variable_speed_period
    if period is None:
        return
    if (begins := period.start_speed) is not None:
        key = f"start_speed = {exact(begins)} rad/s"
    elif (begins := profile.period_begins(first)) is not None:
        key = f"start_time = {exact(period.start_time or 0.0)} s"
    else:
        return
    ends = begins + period.acceleration * period.duration
    # The period may begin at any speed from standstill up, also below the run's first speed: a
    # period that the run begins above is omitted.
    lowest = min(first, 0.0)
    if not lowest <= begins < target or not lowest <= ends <= target:
        below = f"start.speed = {exact(first)}" if first < 0 else "0"
        raise ValueError(
            f"profile.variable_speed_period.{key}: the period runs from {exact(begins)} to "
            f"{exact(ends)} rad/s, which must lie between {below} and target_speed = "
            f"{exact(target)}"
        )


def _check_segments(
    profile: SegmentsProfile, first: float, max_speed: float, max_acceleration: float
) -> None:
    """Refuse segments whose acceleration, or any of their possible final speeds, is too large."""
    _, *ends = profile.speeds(first)
    for index, (segment, (low, high)) in enumerate(zip(profile.segments, ends, strict=True)):
        key = f"profile.segments.{index}"
        _check_acceleration(key, abs(segment.acceleration or 0.0), max_acceleration)
        if max(-low, high) <= max_speed:
            continue
        if segment.to is not None:
            raise ValueError(beyond(f"{key}.to", segment.to, max_speed))
        farthest = low if -low > high else high
        raise ValueError(
            f"{key}: ends at {exact(farthest)} rad/s, which is beyond spindle.max_speed = "
            f"{exact(max_speed)} rad/s; shorten it, accelerate less or raise the limit"
        )


def _check_acceleration(key: str, acceleration: float, most: float) -> None:
    """Refuse an acceleration [rad/s^2] at a key that is larger than ``most``."""
    if acceleration > most:
        raise ValueError(
            f"{key}.acceleration = {exact(acceleration)} rad/s^2: is more than "
            f"spindle.max_acceleration = {exact(most)} rad/s^2, so that a live drive could not "
            "follow the profile"
        )
