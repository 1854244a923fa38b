"""Spindle-speed profiles of scenes, and their checks."""

from typing import Annotated, Literal, get_args

from pydantic import Field, model_validator

from ab_sim.base.errors import exact
from ab_sim.scene.adaptive import AdaptiveProfile, RunUp
from ab_sim.scene.quantities import Number, quantity
from ab_sim.scene.section import Section
from ab_sim.scene.segments import KIND, SegmentsProfile


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

        Args:
            first: speed at which the run begins [rad/s].

        Returns:
            None if the profile has no such period, or if the run begins above its start speed or
            at or above the target speed.
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

    Args:
        profile: the profile.
        first: speed at which it begins [rad/s].
        max_speed: largest speed of the spindle [rad/s]; infinite if unknown.
        max_acceleration: largest acceleration of the spindle [rad/s^2]; infinite if unknown.

    Raises:
        ValueError: a speed or acceleration of the profile is beyond a limit, or the profile cannot
            begin at this speed; the message names key, value, allowed range and remedy.
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
    if profile.target_speed > max_speed:
        raise ValueError(beyond("profile.target_speed", profile.target_speed, max_speed))
    _check_acceleration("profile", profile.acceleration, max_acceleration)


def _check_start_up(
    profile: StartUpProfile, first: float, max_speed: float, max_acceleration: float
) -> None:
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
    if acceleration > most:
        raise ValueError(
            f"{key}.acceleration = {exact(acceleration)} rad/s^2: is more than "
            f"spindle.max_acceleration = {exact(most)} rad/s^2, so that a live drive could not "
            "follow the profile"
        )
