"""Interface that the study requires of a method."""

from typing import Any, Protocol

from ab_sim.base.errors import AbSimError
from ab_sim.drive.accuracy.deviation import Samples


class FailedError(AbSimError):
    """Failure of a method to finish the run; the message appears in the method's row."""


class MeasuredMethod(Protocol):
    """Method at one setting, on one scene."""

    name: str
    peer: bool
    """True if the method is another package's."""
    step: float | None
    """Step [s]; None for methods that choose it."""
    tolerance: float | None
    """Relative tolerance; None for methods with a fixed step."""
    evaluations: int | None
    """Evaluations of the right-hand side in the last run; None if unknown."""

    def prepare(self) -> None:
        """Return to the start; this is not timed."""

    def run(self) -> Any:
        """Take all steps and keep samples; this is timed.

        Raises:
            FailedError: the method could not finish.
        """

    def samples(self, kept: Any) -> Samples:
        """Convert the result of ``run`` to samples."""

    def energy_error(self) -> float | None:
        """Return the energy balance's error, from a separate run; None without a balance."""
