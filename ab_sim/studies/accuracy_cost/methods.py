"""What the study needs of a method, whoever wrote it."""

from typing import Any, Protocol

from ab_sim.accuracy.deviation import Samples
from ab_sim.errors import AbSimError


class FailedError(AbSimError):
    """A method could not finish the run; the text says how, and becomes a row of the table."""


class MeasuredMethod(Protocol):
    """One method at one setting, on one scene."""

    name: str
    peer: bool
    """Whether it is not the package's."""
    step: float | None
    """s; None for methods that choose it."""
    tolerance: float | None
    """Relative; None for methods with a fixed step."""
    evaluations: int | None
    """Of the right-hand side in the last run; None where unknown."""

    def prepare(self) -> None:
        """What is not timed: back to the start."""

    def run(self) -> Any:
        """What is timed: all steps, with samples kept.

        Raises:
            FailedError: it could not finish.
        """

    def samples(self, kept: Any) -> Samples:
        """What ``run`` returned, as samples."""

    def energy_error(self) -> float | None:
        """Error of the energy balance, in a run of its own; None where none is kept."""
