"""Execution of an adaptive start-up by ``ab_sim.control``, as in offline runs; no ROS."""

import math
from collections.abc import Mapping
from typing import Any

from ab_msgs_py import topics
from ab_sim.control import StartUp, StartUpSettings, State
from ab_sim.control.sensor_monitor import TEXTS, Reason
from ab_sim.model.spindle.profile_execution import DriveEstimates
from ab_sim.nodes.paired_samples import PairedSamples, Reading, SpindleSample

SAID_TWICE = State.DONE, State.ABORTING, State.ABORTED
"""States with which the controller's own status text begins."""

SPINDLE_SILENT = f"{topics.JOINT_STATES.name} is silent, the vibration sensor is not"


class AdaptiveExecution:
    """Adaptive start-up in progress; its public methods are those of ``ProfileExecution``.

    Args:
        settings: settings of the start-up's controller.
        first: initial speed of the spindle [rad/s].
    """

    def __init__(self, settings: StartUpSettings, first: float) -> None:
        self.first = first
        self.segment = 0, 0
        self._start_up = StartUp(settings)
        self._samples = PairedSamples(self._start_up.sample)
        self._said, self._text = 0, self._start_up.words

    @property
    def words(self) -> str:
        """Present action, as text; see ``ProfileExecution``."""
        state, text = self._start_up.state, self._text
        return text.removeprefix(f"{state.text}: ") if state in SAID_TWICE else text

    @property
    def ended(self) -> bool:
        """True if the final speed is held; see ``ProfileExecution``."""
        return self._start_up.state in (State.DONE, State.GAVE_UP)

    @property
    def reached(self) -> bool:
        """True if the start-up ended at the running speed; see ``ProfileExecution``."""
        return self._start_up.state is State.DONE

    @property
    def failure(self) -> str:
        """Reason for an abort; see ``ProfileExecution``."""
        if self._start_up.state not in (State.ABORTING, State.ABORTED):
            return ""
        # Without spindle samples, readings are not passed on: the controller sees a silent sensor.
        silent = self._start_up.reason == TEXTS[Reason.SILENT] and self._samples.spindle_is_silent
        return f"{self.words}; {SPINDLE_SILENT}" if silent else self.words

    @property
    def why(self) -> str:
        """Problem that does not abort the start-up; see ``ProfileExecution``."""
        return self.words if self._start_up.state is State.GAVE_UP else ""

    @property
    def values(self) -> Mapping[str, str]:
        """Values for the diagnostics, by name; see ``ProfileExecution``."""
        estimates = self._start_up.estimates
        numbers = {
            "critical speed [rad/s]": estimates.critical_speed,
            "critical speed, deviation [rad/s]": estimates.critical_speed_deviation,
            "net unbalance [m]": abs(estimates.net_unbalance),
            "net unbalance, deviation [m]": estimates.net_unbalance_deviation,
            "net unbalance before the balls moved [m]": estimates.without_balls,
        }
        return {
            **{key: _text(number) for key, number in numbers.items()},
            "dwells": str(estimates.dwells),
            "retries": str(estimates.retries),
            "samples without the spindle's angle": str(self._samples.unpaired),
        }

    @property
    def estimates(self) -> DriveEstimates:
        """Estimates of the drive's properties; see ``ProfileExecution``."""
        estimates = self._start_up.estimates
        return DriveEstimates(
            estimates.critical_speed,
            estimates.critical_speed_deviation,
            abs(estimates.net_unbalance),
            estimates.net_unbalance_deviation,
        )

    def begin(self, now: float) -> None:
        """Do nothing: time is that of the samples; see ``ProfileExecution``."""

    def spindle(self, sample: SpindleSample) -> None:
        """Process a sample of the spindle."""
        self._samples.spindle(sample)

    def reading(self, reading: Reading) -> None:
        """Process a sample of the sensor."""
        self._samples.reading(reading)

    def command(self, now: float) -> float | None:
        """Return the speed to command [rad/s]; None before the first sample."""
        speed = self._start_up.command(now)
        # The text of a decision is kept: its estimates change later, and would be reported again.
        if self._start_up.decision.number != self._said:
            self._said, self._text = self._start_up.decision
        return None if self._start_up.state is State.WAITING else speed

    def state(self) -> dict[str, Any]:
        """Return the state of the execution; see ``ProfileExecution``."""
        return {
            "numbers": self._start_up.state_numbers(),
            "samples": self._samples.state(),
            "text": self._text,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore a state; see ``ProfileExecution``."""
        self._start_up.restore(tuple(float(number) for number in state["numbers"]))
        self._samples.restore(state["samples"])
        self._said, self._text = self._start_up.decision.number, str(state["text"])


def _text(number: float) -> str:
    return "not known yet" if math.isnan(number) else f"{number:.6g}"
