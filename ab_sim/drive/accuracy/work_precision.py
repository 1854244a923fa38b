"""Setting chosen for a requested accuracy."""

from collections.abc import Mapping
from typing import NamedTuple

from ab_sim.drive.accuracy.deviation import Deviation
from ab_sim.scene.sections import Accuracy

SAFETY = 4.0
"""Safety factor on the measured error before comparison with the requested one."""


class WorkPrecision(NamedTuple):
    """Chosen setting with its measured error and cost."""

    asked: Accuracy
    stepper: str
    step: float
    """Step [s]."""
    parameters: Mapping[str, float]
    """Parameters of the stepper."""
    measured: Deviation
    """Largest error over the run, without safety factor; includes the reference's own error."""
    reference: str
    """Reference of the measurement: one of the package's steppers, at a finer setting."""
    unit: str
    """Unit of the whirl's error: e, or the race radius R."""
    seconds: float
    """CPU time per simulated second, measured at the time of the choice."""

    @property
    def reason(self) -> str:
        """Text for users: measured error, requested accuracy and cost."""
        measured, asked = [], []
        for tolerance, error, unit in (
            (self.asked.angle, self.measured.angle, "rad"),
            (self.asked.whirl, self.measured.whirl, self.unit),
        ):
            if tolerance is not None:
                measured.append(f"{error:.1e} {unit}")
                asked.append(f"{tolerance:g} {unit}")
        return (
            f"{setting(self.stepper, self.step, self.parameters)}: "
            f"measured error {', '.join(measured)} "
            f"(asked {', '.join(asked)}, safety factor {SAFETY:g}) by ab_sim's own "
            f"{self.reference}, "
            f"{1e6 * self.seconds:.0f} us of CPU time per simulated second"
        )

    def report(self) -> dict[str, object]:
        """Return JSON-able values in SI units, the whirl in ``whirl_unit``."""
        return {
            "asked": self.asked.model_dump(exclude_none=True),
            "measured": {"angle": self.measured.angle, "whirl": self.measured.whirl},
            "measured_by": f"ab_sim's own {self.reference}",
            "whirl_unit": self.unit,
            "safety_factor": SAFETY,
            "cpu_seconds_per_simulated_second": self.seconds,
            "reason": self.reason,
        }


def setting(stepper: str, step: float, parameters: Mapping[str, float]) -> str:
    """Return a stepper with its step [s] and parameters as text."""
    parameters_text = "".join(f", {name} {value:g}" for name, value in parameters.items())
    return f"{stepper} at {1e3 * step:g} ms{parameters_text}"


def share_of(asked: Accuracy, angle: float, whirl: float) -> float:
    """Return the larger ratio of error to requested accuracy; at most 1 if both are met."""
    shares = [
        error / tolerance
        for error, tolerance in ((angle, asked.angle), (whirl, asked.whirl))
        if tolerance is not None
    ]
    return max(shares)
