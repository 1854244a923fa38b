"""State of deck and balls at rest on the axes that turn with the rotor."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ab_sim.analysis.equilibria.resting import field_at, kinds_of, state_of
from ab_sim.analysis.equilibria.spectrum import balanced_spectrum, spectrum_of
from ab_sim.base.presentation import in_one_turn
from ab_sim.model.dynamics.system import System

WORDS = {True: "stable", False: "unstable", None: "undecided"}


@dataclass(frozen=True)
class RestingState:
    """Resting state of deck and balls, with its linear stability."""

    label: str
    """Name of the state.

    p+q: p balls on the side of the displacement, q opposite; /1 is the larger and /2 the smaller W
    of two. One sign per ball if balls differ. ``balanced``: W = 0.
    """
    u: np.ndarray
    """Displacement of the deck on the rotating axes [m], shape (2,)."""
    theta: np.ndarray
    """Ball angles from the unbalance [rad], -pi to pi, shape (n,)."""
    eigenvalues: np.ndarray
    """Eigenvalues [1/s] by falling real part, complex, shape (4 + 2 n,)."""
    structural_zeros: int
    """Number of eigenvalues that are exactly 0 because the state is part of a continuum."""
    lambda_max: float
    """Largest real part without the structural zeros [1/s]."""
    doubt: float
    """Bound of the rounding error of ``lambda_max`` [1/s]."""
    assignments: int | None
    """Number of ways to assign the balls to the places; None in a continuum."""

    @property
    def W(self) -> float:
        """Radius |u| [m]."""
        return float(np.hypot(*self.u))

    @property
    def phase(self) -> float | None:
        """Phase of the displacement from the unbalance [rad]; None without displacement."""
        return math.atan2(self.u[1], self.u[0]) if self.W > 0.0 else None

    @property
    def stable(self) -> bool | None:
        """Verdict of the linear test; None if the growth rate is 0 within rounding.

        Structural zeros are ignored: nothing moves along a continuum of resting states.
        """
        return None if abs(self.lambda_max) <= self.doubt else self.lambda_max < 0.0

    @property
    def verdict(self) -> str:
        """Verdict as text: ``stable``, ``unstable`` or ``undecided``."""
        return WORDS[self.stable]

    def relabelled(self, label: str) -> "RestingState":
        """Return a copy with another label."""
        return replace(self, label=label)

    def report(self) -> dict[str, object]:
        """Return the state as JSON-able values; complex numbers are [real, imaginary]."""
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
    """Return a known resting state with its eigenvalues at a speed [rad/s].

    Args:
        system: a ``resting_system``.
        speed: spindle speed w [rad/s].
        label, u, theta, structural_zeros, assignments: see ``RestingState``.
        balance_alike: whether three or more equal balls balance the rotor in an isotropic
            suspension.
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
