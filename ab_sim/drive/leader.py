"""What commands a drive whose profile decides while it runs, from what is measured."""

from typing import Any, NamedTuple, Protocol

from ab_sim.drive.trajectory import Trajectory


class Decided(NamedTuple):
    """A decision, and when it fell."""

    time: float
    """s."""
    text: str
    """For people: what is done from now on, and why."""


class Leader(Protocol):
    """It hears the drive's sensors, as their faults let it, and commands the drive.

    At every period, from t = 0 on, it is asked for a speed, after it has heard all samples up to
    then, that one included.
    """

    decisions: list[Decided]
    """Since it was made."""
    aborted: Decided | None
    """Its decision to run down, with why, if it fell since then."""

    @property
    def state(self) -> Any:
        """All that it needs to go on, as JSON-able values."""

    def restore(self, state: Any) -> None:
        """Go on from a state of one of the same scene.

        Raises:
            ValueError: it is none.
        """

    def next(self, step: int) -> int:
        """The first step after this one at which a command is due."""

    def command(self, newest: Trajectory, step: int) -> float | None:
        """The speed [rad/s] to be commanded at a step; None: none is due, or it waits.

        Args:
            newest: every step since it was last asked, this one included; none at the start.
            step: the present one.
        """


def stamp(step: int, step_ns: int) -> float:
    """The time of a step [s], to the bit as what hears a message with its stamp [ns] has it."""
    return step * step_ns * 1e-9
