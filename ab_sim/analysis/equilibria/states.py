"""A state in which deck and balls rest on the axes that turn with the rotor."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ab_sim.analysis.equilibria.resting import field_at, kinds_of, state_of
from ab_sim.analysis.equilibria.spectrum import balanced_spectrum, spectrum_of
from ab_sim.conventions import in_one_turn
from ab_sim.dynamics.system import System

WORDS = {True: "stable", False: "unstable", None: "undecided"}


@dataclass(frozen=True)
class RestingState:
    """Where deck and balls rest, and what small disturbances do."""

    label: str
    """p+q: p balls on the side of the displacement, q opposite, /1 the larger and /2 the smaller
    W of two; a sign per ball where they differ; balanced: W = 0."""
    u: np.ndarray
    """The deck's displacement on the rotating axes [m], shape (2,)."""
    theta: np.ndarray
    """Ball angles from the unbalance [rad], -pi to pi, shape (n,)."""
    eigenvalues: np.ndarray
    """[1/s], by falling real part, complex, shape (4 + 2 n,)."""
    structural_zeros: int
    """How many of them are 0 whatever the numbers, for the state is one of a continuum."""
    lambda_max: float
    """The largest real part but for these [1/s]."""
    doubt: float
    """What rounding can do to it [1/s]."""
    assignments: int | None
    """How many ways there are to give the places to the balls; None in a continuum."""

    @property
    def W(self) -> float:
        """|u| [m]."""
        return float(np.hypot(*self.u))

    @property
    def phase(self) -> float | None:
        """Of the displacement [rad], from the unbalance; None where there is none."""
        return math.atan2(self.u[1], self.u[0]) if self.W > 0.0 else None

    @property
    def stable(self) -> bool | None:
        """By the linear test; None where it decides nothing: a growth rate of 0 but for rounding.

        Structural zeros do not count: along a continuum of resting states nothing moves.
        """
        return None if abs(self.lambda_max) <= self.doubt else self.lambda_max < 0.0

    @property
    def verdict(self) -> str:
        """stable, unstable or undecided."""
        return WORDS[self.stable]

    def relabelled(self, label: str) -> "RestingState":
        """The same by another name."""
        return replace(self, label=label)

    def report(self) -> dict[str, object]:
        """As JSON-able values; complex numbers are [real, imaginary]."""
        return {
            "label": self.label,
            "W": self.W,
            "phase": self.phase,
            "u": self.u.tolist(),
            "theta": self.theta.tolist(),
            "assignments": self.assignments,
            "eigenvalues": [[float(x.real), float(x.imag)] for x in self.eigenvalues],
            "structural_zeros": self.structural_zeros,
            "lambda_max": self.lambda_max,
            "stable": self.stable,
            "verdict": self.verdict,
        }


def resting_state(
    system: System,
    speed: float,
    label: str,
    u: np.ndarray,
    theta: np.ndarray,
    structural_zeros: int = 0,
    assignments: int | None = None,
    balance_alike: bool = False,
) -> RestingState:
    """A state that is known to rest, with its eigenvalues at a speed [rad/s].

    Args:
        system: a ``resting_system``.
        speed: w [rad/s].
        label, u, theta, structural_zeros, assignments: as of RestingState.
        balance_alike: whether three and more equal balls balance in an isotropic suspension.
    """
    field, theta = field_at(system, speed), in_one_turn(np.asarray(theta, float))
    jacobian = field.jacobian(0.0, state_of(system, speed, u, theta))
    if balance_alike:
        spectrum = balanced_spectrum(jacobian, field.layout, theta)
    else:
        spectrum = spectrum_of(jacobian, field.layout, theta, kinds_of(system))
    largest, doubt = spectrum.largest(structural_zeros)
    return RestingState(
        label, u, theta, spectrum.values, structural_zeros, largest, doubt, assignments
    )
