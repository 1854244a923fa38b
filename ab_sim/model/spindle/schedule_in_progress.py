"""Schedule of a profile in progress, whose segments may end on conditions."""

from typing import TYPE_CHECKING

from ab_sim.model.spindle.schedule import ScheduledSegment, SpeedSchedule
from ab_sim.model.spindle.speed_laws import Ramp

if TYPE_CHECKING:
    from ab_sim.scene.profiles import AnyProfile
    from ab_sim.scene.segments import Until


class ScheduleInProgress:
    """Schedule as far as it is decided; later segments with conditions get their longest duration.

    Args:
        profile: the profile.
        first: speed at which it begins [rad/s].
    """

    def __init__(self, profile: "AnyProfile", first: float) -> None:
        self._segments = profile.segments if profile.kind == "segments" else ()
        self.profile = SpeedSchedule.asked(profile, first)
        """Schedule from now on."""
        self.count = len(self.profile.segments) - 1
        """Number of segments."""
        self._first = 0

    def number(self, time: float) -> int:
        """Return the number of the segment at a time [s], from 0; the count after the last one."""
        return self._first + self.profile.number_at(time)

    def until(self, number: int) -> "Until | None":
        """Return the condition that ends a segment; None if the segment has none."""
        return self._segments[number].until if number < len(self._segments) else None

    def leave(self, time: float) -> None:
        """End the present segment at a time [s]; the next one begins at the speed reached."""
        index = self.number(time) + 1
        self.profile = SpeedSchedule.of_segments(
            self._segments[index:], float(self.profile.speed(time)), start=time
        )
        self._first = index

    def words(self, number: int) -> str:
        """Describe a present or future segment."""
        scheduled, until = self.profile.segments[number - self._first], self.until(number)
        if until is None:
            return _words(scheduled)
        slope = scheduled.segment.acceleration(0.0)
        how = f"accelerate at {slope:g} rad/s^2" if slope else f"hold {_speed(scheduled):g} rad/s"
        return f"{how} until {until.words}, at most {until.at_most:g} s"


def _speed(scheduled: ScheduledSegment) -> float:
    return _rounded(scheduled.segment.speed(0.0))


def _rounded(speed: float) -> float:
    return round(float(speed), 9) + 0.0  # + 0.0 turns -0 into 0


def _words(scheduled: ScheduledSegment) -> str:
    lasts = scheduled.end - scheduled.start
    begin, end = _speed(scheduled), _rounded(scheduled.segment.speed(lasts))
    if not isinstance(scheduled.segment, Ramp):
        return f"from {begin:g} to {end:g} rad/s along a raised cosine in {lasts:g} s"
    if scheduled.segment.slope == 0.0 or lasts == 0.0:
        return f"hold {begin:g} rad/s for {lasts:g} s"
    return f"from {begin:g} to {end:g} rad/s at {scheduled.segment.slope:g} rad/s^2"
