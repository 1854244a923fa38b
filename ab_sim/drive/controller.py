"""Controllers of drives whose profile depends on measurements during the run."""

from typing import Any, NamedTuple, Protocol

from ab_sim.drive.trajectory import Trajectory


class TimedDecision(NamedTuple):
    """A decision and its time."""

    time: float
    """Time [s]."""
    text: str
    """Action from now on and its reason, for people."""


class RunController(Protocol):
    """Controller that receives sensor readings, faults included, and commands the drive.

    ``command`` is called every period from t = 0 on, with all samples up to and including that
    instant.
    """

    decisions: list[TimedDecision]
    """Decisions so far."""
    aborted: TimedDecision | None
    """Decision to ramp down, with its reason; None if there was none."""

    @property
    def state(self) -> Any:
        """Return the complete state as JSON-able values."""

    def restore(self, state: Any) -> None:
        """Continue from a state of a controller of the same scene.

        Raises:
            ValueError: the state is not valid.
        """

    def next(self, step: int) -> int:
        """Return the first step after this one at which a command is due."""

    def command(self, newest: Trajectory, step: int) -> float | None:
        """Return the speed to command at a step [rad/s]; None if no command is due or ready.

        Args:
            newest: all steps since the last call, this one included; empty at the start.
            step: the present step.
        """


def stamped_time(step: int, step_ns: int) -> float:
    """Return the time of a step [s], bit-identical to the value computed from its stamp [ns]."""
    return step * step_ns * 1e-9
