"""The setting that was chosen for an accuracy."""

from collections.abc import Mapping
from typing import NamedTuple

from ab_sim.accuracy.deviation import Deviation
from ab_sim.scene.sections import Accuracy

SAFETY = 4.0
"""What the measured error is multiplied by before it is compared with what is asked."""


class WorkPrecision(NamedTuple):
    """The setting taken, what error was measured with it, and what it costs."""

    asked: Accuracy
    stepper: str
    step: float
    """s."""
    parameters: Mapping[str, float]
    """What the stepper is given."""
    measured: Deviation
    """Largest error over the scene's run, without safety factor; the reference's is included."""
    reference: str
    """What it was measured against: one of the package's own steppers, at a finer setting."""
    unit: str
    """Of the whirl's error: e, or R, the race's radius."""
    seconds: float
    """CPU time per simulated second, as measured when the choice was made."""

    @property
    def reason(self) -> str:
        """For people: what was measured, asked and paid."""
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
        """The same as JSON-able values, SI units, the whirl in ``whirl_unit``."""
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
    """For people: a stepper with its step [s] and what else it is given."""
    given = "".join(f", {name} {value:g}" for name, value in parameters.items())
    return f"{stepper} at {1e3 * step:g} ms{given}"


def share_of(asked: Accuracy, angle: float, whirl: float) -> float:
    """Errors as a share of what is asked, the larger one: at most 1 where they are within it."""
    shares = [
        error / tolerance
        for error, tolerance in ((angle, asked.angle), (whirl, asked.whirl))
        if tolerance is not None
    ]
    return max(shares)
