"""An adaptive start-up under way (``ab_sim.control``): the same code as offline; no ROS."""

import math
from collections.abc import Mapping
from typing import Any

from ab_msgs_py import topics
from ab_sim.control import StartUp, StartUpSettings, State
from ab_sim.control.watch import TEXTS, Reason
from ab_sim.nodes.paired_samples import PairedSamples, Reading, SpindleSample
from ab_sim.spindle.course import Believed

SAID_TWICE = State.DONE, State.ABORTING, State.ABORTED
"""States that the controller's own status begins with."""

SPINDLE_SILENT = f"it is {topics.JOINT_STATES.name} that is silent, the sensor goes on"


class AdaptiveCourse:
    """One start-up under way.

    Args:
        settings: what its controller is told.
        first: the speed at which it begins [rad/s].
    """

    def __init__(self, settings: StartUpSettings, first: float) -> None:
        self.first = first
        self.segment = 0, 0
        self._start_up = StartUp(settings)
        self._samples = PairedSamples(self._start_up.sample)
        self._said, self._text = 0, self._start_up.words

    @property
    def words(self) -> str:
        """As of ``Course``."""
        state, text = self._start_up.state, self._text
        return text.removeprefix(f"{state.text}: ") if state in SAID_TWICE else text

    @property
    def ended(self) -> bool:
        """As of ``Course``."""
        return self._start_up.state in (State.DONE, State.GAVE_UP)

    @property
    def reached(self) -> bool:
        """As of ``Course``."""
        return self._start_up.state is State.DONE

    @property
    def failure(self) -> str:
        """As of ``Course``."""
        if self._start_up.state not in (State.ABORTING, State.ABORTED):
            return ""
        # The controller has no samples in either case: a reading without an angle is none.
        silent = self._start_up.reason == TEXTS[Reason.SILENT] and self._samples.spindle_is_silent
        return f"{self.words}; {SPINDLE_SILENT}" if silent else self.words

    @property
    def why(self) -> str:
        """As of ``Course``."""
        return self.words if self._start_up.state is State.GAVE_UP else ""

    @property
    def values(self) -> Mapping[str, str]:
        """As of ``Course``."""
        belief = self._start_up.belief
        numbers = {
            "critical speed [rad/s]": belief.critical_speed,
            "critical speed, deviation [rad/s]": belief.critical_speed_deviation,
            "net unbalance [m]": abs(belief.net_unbalance),
            "net unbalance, deviation [m]": belief.net_unbalance_deviation,
            "net unbalance before the balls moved [m]": belief.without_balls,
        }
        return {
            **{key: _text(number) for key, number in numbers.items()},
            "dwells": str(belief.dwells),
            "retries": str(belief.retries),
            "samples without the spindle's angle": str(self._samples.unpaired),
        }

    @property
    def believed(self) -> Believed:
        """As of ``Course``."""
        belief = self._start_up.belief
        return Believed(
            belief.critical_speed,
            belief.critical_speed_deviation,
            abs(belief.net_unbalance),
            belief.net_unbalance_deviation,
        )

    def begin(self, now: float) -> None:
        """As of ``Course``: its clock is the samples'."""

    def spindle(self, sample: SpindleSample) -> None:
        """A sample of the spindle."""
        self._samples.spindle(sample)

    def reading(self, reading: Reading) -> None:
        """A sample of the sensor."""
        self._samples.reading(reading)

    def command(self, now: float) -> float | None:
        """As of ``Course``; nothing before the first sample."""
        speed = self._start_up.command(now)
        # What it decides is said once; what it believes goes on changing.
        if self._start_up.decision.number != self._said:
            self._said, self._text = self._start_up.decision
        return None if self._start_up.state is State.WAITING else speed

    def state(self) -> dict[str, Any]:
        """As of ``Course``."""
        return {
            "numbers": self._start_up.state_numbers(),
            "samples": self._samples.state(),
            "text": self._text,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """As of ``Course``."""
        self._start_up.restore(tuple(float(number) for number in state["numbers"]))
        self._samples.restore(state["samples"])
        self._said, self._text = self._start_up.decision.number, str(state["text"])


def _text(number: float) -> str:
    return "not known yet" if math.isnan(number) else f"{number:.6g}"
