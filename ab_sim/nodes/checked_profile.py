"""Check of a requested profile, and choice of its execution and of the topics that it needs."""

import json
from collections.abc import Mapping
from typing import Any

from ab_sim.base.errors import InputError, exact
from ab_sim.control import SensorFacts, StartUpSettings
from ab_sim.drive.adaptive_controller import settings_of
from ab_sim.model.spindle import SpeedSchedule
from ab_sim.model.spindle.profile_execution import ProfileExecution, ProfileInputs
from ab_sim.model.spindle.segments_execution import SegmentsExecution, waits_for_vibration
from ab_sim.nodes.adaptive_execution import AdaptiveExecution
from ab_sim.scene.load import RequestedProfile
from ab_sim.scene.profiles import AdaptiveProfile

PERIODS_AGREE = 1e-9
"""Largest relative difference between the periods of an adaptive start-up and of the commands."""


class CheckedProfile:
    """Requested and checked profile before its start.

    Args:
        asked: requested profile.
        source: value of the parameter that names the profile.
        changes: changes to the profile, each ``key=value``.
        period: time between two commands [s].

    Raises:
        InputError: the profile requires another period.
    """

    def __init__(
        self, asked: RequestedProfile, source: str, changes: list[str], period: float
    ) -> None:
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
        """Largest magnitude of the profile's acceleration [rad/s^2]; 0: the speed is constant."""
        profile = self._asked.profile
        if isinstance(profile, AdaptiveProfile):
            return profile.acceleration
        return SpeedSchedule.asked(profile, self._asked.first).steepest

    @property
    def schedule(self) -> SpeedSchedule | None:
        """Speed over time; None if it depends on measurements."""
        if isinstance(self._asked.profile, AdaptiveProfile) or waits_for_vibration(self._asked):
            return None
        return SpeedSchedule.asked(self._asked.profile, self._asked.first)

    @property
    def inputs(self) -> ProfileInputs:
        """Input topics that the profile needs."""
        profile, scene = self._asked.profile, self._asked.scene
        if isinstance(profile, AdaptiveProfile):
            name = profile.sensor
            probe = scene is not None and name in scene.probes
            alike = () if scene is None else scene.probes if probe else scene.sensors
            return ProfileInputs(
                sensor=name, first_sensor=name == next(iter(alike), name), probe=probe
            )
        return ProfileInputs(vibration=waits_for_vibration(self._asked))

    @property
    def made_of(self) -> dict[str, Any]:
        """Definition of the profile, as JSON-able values, to compare it with that of a snapshot."""
        asked = self._asked
        definition: Mapping[str, Any] = {
            "profile": asked.profile.model_dump(mode="json"),
            "first": asked.first,
            "settings": self._settings,
        }
        return dict(json.loads(json.dumps(definition)))

    def execution(self, silence: float) -> ProfileExecution:
        """Return the execution of the profile, ready to begin.

        Args:
            silence: longest time without vibration messages while a condition needs them [s].
        """
        if self._settings is not None:
            return AdaptiveExecution(self._settings, self._asked.first)
        return SegmentsExecution(self._asked, self._period, silence)


def _settings(asked: RequestedProfile, profile: AdaptiveProfile) -> StartUpSettings:
    if asked.scene is not None:
        return settings_of(asked.scene)
    # A profile without a scene does not describe the sensor. The noise is then estimated. Unknown
    # angles of the sensor's axes only turn the estimated unbalance.
    return profile.settings(SensorFacts("acceleration", 2))
