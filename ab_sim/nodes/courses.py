"""Which course a profile that is asked for takes, and what that needs."""

import json
from collections.abc import Mapping
from typing import Any

from ab_sim.control import SensorFacts, StartUpSettings
from ab_sim.drive.adaptive import settings_of
from ab_sim.errors import InputError, exact
from ab_sim.nodes.adaptive_course import AdaptiveCourse
from ab_sim.scene.adaptive import AdaptiveProfile
from ab_sim.scene.profile_file import AskedProfile
from ab_sim.spindle import SpeedSchedule
from ab_sim.spindle.course import Course, Hears
from ab_sim.spindle.segments_course import SegmentsCourse, waits_for_vibration

PERIODS_AGREE = 1e-9
"""By how much of itself the period of an adaptive start-up may differ from that of the commands."""


class PlannedCourse:
    """A profile that was asked for, checked, before it is begun.

    Args:
        asked: the profile.
        source: the parameter's text that names it.
        changes: to it, each ``key=value``.
        period: s between two commands.

    Raises:
        InputError: it cannot be run with that period.
    """

    def __init__(self, asked: AskedProfile, source: str, changes: list[str], period: float) -> None:
        self.source, self.changes = source, changes
        self._asked, self._period = asked, period
        self._settings: StartUpSettings | None = None
        profile = asked.profile
        if isinstance(profile, AdaptiveProfile):
            if abs(profile.command_period / period - 1.0) > PERIODS_AGREE:
                raise InputError(
                    f"profile.command_period = {exact(profile.command_period)} s: this node "
                    f"commands every {exact(period)} s; start it with command_rate = "
                    f"{exact(1.0 / profile.command_period)} [1/s], or change the period"
                )
            self._settings = _settings(asked, profile)

    @property
    def steepest(self) -> float:
        """The largest magnitude of its acceleration [rad/s^2]; 0: it only holds its speed."""
        profile = self._asked.profile
        if isinstance(profile, AdaptiveProfile):
            return profile.acceleration
        return SpeedSchedule.asked(profile, self._asked.first).steepest

    @property
    def schedule(self) -> SpeedSchedule | None:
        """Its speed over time; None if what is measured decides."""
        if isinstance(self._asked.profile, AdaptiveProfile) or waits_for_vibration(self._asked):
            return None
        return SpeedSchedule.asked(self._asked.profile, self._asked.first)

    @property
    def hears(self) -> Hears:
        """What it needs to hear."""
        profile, scene = self._asked.profile, self._asked.scene
        if isinstance(profile, AdaptiveProfile):
            name = profile.sensor
            probe = scene is not None and name in scene.probes
            alike = () if scene is None else scene.probes if probe else scene.sensors
            return Hears(sensor=name, first_sensor=name == next(iter(alike), name), probe=probe)
        return Hears(vibration=waits_for_vibration(self._asked))

    @property
    def made_of(self) -> dict[str, Any]:
        """What it follows from, as JSON-able values: a snapshot is of one that has the same."""
        asked = self._asked
        told: Mapping[str, Any] = {
            "profile": asked.profile.model_dump(mode="json"),
            "first": asked.first,
            "settings": self._settings,
        }
        return dict(json.loads(json.dumps(told)))

    def course(self, silence: float) -> Course:
        """The same, to be begun.

        Args:
            silence: s for which vibration may be missing where a condition needs it.
        """
        if self._settings is not None:
            return AdaptiveCourse(self._settings, self._asked.first)
        return SegmentsCourse(self._asked, self._period, silence)


def _settings(asked: AskedProfile, profile: AdaptiveProfile) -> StartUpSettings:
    if asked.scene is not None:
        return settings_of(asked.scene)
    # A profile by itself says nothing of the sensor: its noise is estimated, and the angle of its
    # axes only turns what is believed of the unbalance.
    return profile.settings(SensorFacts("acceleration", 2))
