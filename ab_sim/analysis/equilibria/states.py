"""States of deck and balls at rest on the axes that turn with the rotor, with their eigenvalues.

The eigenvalues are those of the running kernel's exact Jacobian. Equal balls at one place are
interchangeable. Their relative motion decouples into identical 2x2 blocks, so that repeated
eigenvalues are exact and 64 balls cost as little as a few. Equal balls in balance act on the deck
only through sum t_i d_i, with t_i the tangents. Motions that do not change this sum decouple as
well.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import eig, matrix_balance

from ab_sim.analysis.equilibria.resting import field_at, kinds_of, state_of
from ab_sim.base.presentation import in_one_turn
from ab_sim.model.dynamics.system import StateLayout, System

SAFETY = 30.0
"""Safety factor on the first-order rounding error of eigenvalues."""
_TOGETHER = 1e-9
"""Angle below which balls are at one place [rad]."""


class _Spectrum(NamedTuple):
    """Eigenvalues by falling real part, with bounds of their rounding errors."""

    values: np.ndarray
    """Eigenvalues [1/s], complex, shape (states,)."""
    doubts: np.ndarray
    """Bounds of the rounding errors [1/s], shape (states,)."""

    def largest(self, structural_zeros: int) -> tuple[float, float]:
        """Return the largest real part without structural zeros, and its error bound [1/s]."""
        kept = np.ones(len(self.values), bool)
        kept[np.argsort(np.abs(self.values), kind="stable")[:structural_zeros]] = False
        if not kept.any():
            return 0.0, 0.0
        first = int(np.flatnonzero(kept)[0])
        near = kept & (self.values.real + self.doubts >= self.values.real[first])
        return float(self.values.real[first]), float(self.doubts[near].max())


def _spectrum(
    jacobian: np.ndarray, layout: StateLayout, theta: np.ndarray, kinds: Sequence[int]
) -> _Spectrum:
    """Return the eigenvalues of a Jacobian, with equal balls at one place treated as a group.

    Parameters
    ----------
    jacobian
        Jacobian at a resting state, shape (states, states).
    layout
        Places of deck, angles and rates in the state.
    theta
        Ball angles [rad], shape (n,).
    kinds
        Kind of each ball; equal balls share a number.
    """
    groups = _groups(theta, kinds)
    size, first = layout.size, layout.rates.start
    common = np.zeros((size, size - 2 * (len(theta) - len(groups))))
    common[layout.deck, layout.deck] = np.eye(layout.deck.stop)
    modes = []
    for k, group in enumerate(groups):
        angles = layout.angles.start + np.array(group)
        rates = first + np.array(group)
        weight = len(group) ** -0.5
        common[angles, layout.deck.stop + k] = weight
        common[rates, layout.deck.stop + len(groups) + k] = weight
        # Relative motion within the group: repeated eigenvalues of one 2x2 block.
        if len(group) > 1:
            one, other = (np.array([angles[i], rates[i]]) for i in (0, 1))
            apart = jacobian[np.ix_(one, one)] - jacobian[np.ix_(one, other)]
            modes += [_eigenvalues(apart)] * (len(group) - 1)
    modes.append(_eigenvalues(common.T @ jacobian @ common))
    return _sorted(modes)


def _balanced_spectrum(jacobian: np.ndarray, layout: StateLayout, theta: np.ndarray) -> _Spectrum:
    """Return the eigenvalues if three or more equal balls balance, in an isotropic suspension.

    The deck, two combinations of angles and the same two of rates act on each other. One further
    combination of angles and of rates represents n - 2 equivalent ones.

    Parameters
    ----------
    jacobian, layout, theta
        See ``_spectrum``.
    """
    along = np.linalg.svd(np.array([-np.sin(theta), np.cos(theta)]))[2]
    coupled, free = np.zeros((layout.size, layout.deck.stop + 4)), np.zeros((layout.size, 2))
    coupled[layout.deck, layout.deck] = np.eye(layout.deck.stop)
    coupled[layout.angles, -4:-2] = coupled[layout.rates, -2:] = along[:2].T
    free[layout.angles, 0] = free[layout.rates, 1] = along[2]
    with_deck = _eigenvalues(coupled.T @ jacobian @ coupled)
    without = _eigenvalues(free.T @ jacobian @ free)
    return _sorted([with_deck, *[without] * (len(theta) - 2)])


def _sorted(spectra: Sequence[tuple[np.ndarray, np.ndarray]]) -> _Spectrum:
    """Return the union of spectra, each with its eigenvalues and their error bounds."""
    values = np.concatenate([values_and_doubts[0] for values_and_doubts in spectra])
    doubts = np.concatenate([values_and_doubts[1] for values_and_doubts in spectra])
    order = np.lexsort((values.imag, -values.real))
    return _Spectrum(values[order], doubts[order])


def _groups(theta: np.ndarray, kinds: Sequence[int]) -> list[list[int]]:
    """Return groups of indices of equal balls that are at one place."""
    groups: list[list[int]] = []
    for i, angle in enumerate(theta):
        for group in groups:
            apart = np.angle(np.exp(1j * (angle - theta[group[0]])))
            if kinds[group[0]] == kinds[i] and abs(apart) <= _TOGETHER:
                group.append(i)
                break
        else:
            groups.append([i])
    return groups


def _eigenvalues(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the eigenvalues of a matrix and bounds of their rounding errors, shape (n,) each.

    The bound is ``SAFETY`` eps |A| / |y^H x| with unit left and right eigenvectors y and x
    (Wilkinson, The Algebraic Eigenvalue Problem, 1965, ch. 2), after balancing the matrix.
    """
    balanced = matrix_balance(matrix, permute=False)[0]
    values, left_vectors, right = eig(balanced, left=True, right=True)  # type: ignore[misc]
    aligned = np.abs(np.einsum("ij,ij->j", left_vectors.conj(), right))
    norm = np.linalg.norm(balanced)
    doubts = SAFETY * np.finfo(float).eps * norm / np.maximum(aligned, 1e-300)
    # The first-order error of a double eigenvalue is infinite; its actual error is of order
    # sqrt(eps).
    return values, np.minimum(doubts, SAFETY * norm * np.finfo(float).eps ** 0.5)


WORDS = {True: "stable", False: "unstable", None: "undecided"}
"""Verdicts in words, by ``RestingState.stable``."""


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

    Parameters
    ----------
    system
        Result of ``resting_system``.
    speed
        Spindle speed w [rad/s].
    label, u, theta, structural_zeros, assignments
        See ``RestingState``.
    balance_alike
        Whether three or more equal balls balance the rotor in an isotropic suspension.
    """
    field, theta = field_at(system, speed), in_one_turn(np.asarray(theta, float))
    jacobian = field.jacobian(0.0, state_of(system, speed, u, theta))
    if balance_alike:
        spectrum = _balanced_spectrum(jacobian, field.layout, theta)
    else:
        spectrum = _spectrum(jacobian, field.layout, theta, kinds_of(system))
    largest, doubt = spectrum.largest(structural_zeros)
    return RestingState(
        label, u, theta, spectrum.values, structural_zeros, largest, doubt, assignments
    )
