"""Natural vibration of the deck in its suspension: modes, and their change with speed.

Around the deck's rest position, M q'' + (C + w G) q' + K q = 0 (``Linearised``), with solutions q =
shape exp(lambda t). Each mode has two eigenvalues: conjugates, or two real ones if it is
overdamped. Shapes are compared and weighted by the kinetic energy (mass matrix M), so that lengths
and angles have a common unit.

Sources: Genta, Dynamics of Rotating Systems (2005), ch. 2 and 3 (whirl, Campbell diagrams);
Allemang, The Modal Assurance Criterion (2003): ``modal_assurance``, weighted by the mass matrix.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq, linear_sum_assignment

from ab_sim.base.presentation import Column, Columns, Presented, number
from ab_sim.base.version import __version__
from ab_sim.model.dynamics.assemble import linearised, system_of
from ab_sim.model.dynamics.at_rest import MATTERS, Linearised
from ab_sim.scene.model import Scene

AVERAGING = "rotor and balls averaged over one turn; balls spread evenly, turning with the rotor"
"""Note on the model of rotor and balls, for tables and pictures."""
SPEEDS = 201
"""Number of spindle speeds in a Campbell diagram."""
_STRAIGHT = 0.01
"""Amount of whirl below which motion counts as straight: an ellipse 200 times as long as wide."""
ZERO = 1e-7
"""Modulus, relative to the largest, below which an eigenvalue counts as zero.

Rounding errors move a double zero eigenvalue by about this amount.
"""
_EQUAL = 1e-9
"""Relative distance below which eigenvalues are equal."""


class Mode(NamedTuple):
    """Natural vibration of the deck."""

    eigenvalues: tuple[complex, complex]
    """Eigenvalues [1/s]: conjugates, positive imaginary part first; or real, slow and fast."""
    shape: np.ndarray
    """Complex shape of the first eigenvalue, shape (n,); the largest entry [m or rad] is 1."""
    whirl: float
    """Degree of whirl: 1 circular in the spindle's sense, -1 against it, 0 straight."""

    @property
    def frequency(self) -> float:
        """Undamped frequency [rad/s]: root of the eigenvalues' product; 0 without stiffness."""
        one, two = self.eigenvalues
        return float(np.sqrt(max(0.0, (one * two).real)))

    @property
    def damped_frequency(self) -> float:
        """Frequency of the damped oscillation [rad/s]; 0 if there is none."""
        return self.eigenvalues[0].imag

    @property
    def damping_ratio(self) -> float | None:
        """Damping relative to critical damping; None without stiffness."""
        total = sum(self.eigenvalues).real
        return 0.0 - 0.5 * total / self.frequency if self.frequency > 0.0 else None

    @property
    def growth(self) -> float:
        """Larger of the two growth rates [1/s]; negative if the mode decays."""
        return max(value.real for value in self.eigenvalues)

    @property
    def sense(self) -> str | None:
        """Sense of whirl: ``forward`` (the spindle's), ``backward``; None if straight."""
        if abs(self.whirl) < _STRAIGHT:
            return None
        return "forward" if self.whirl > 0.0 else "backward"

    def report(self) -> dict[str, object]:
        """Return the mode as JSON-able values; complex numbers are [real, imaginary]."""
        return {
            "frequency": self.frequency,
            "damping_ratio": self.damping_ratio,
            "damped_frequency": self.damped_frequency,
            "shape": [[float(x.real), float(x.imag)] for x in self.shape],
            "eigenvalues": [[float(x.real), float(x.imag)] for x in self.eigenvalues],
            "whirl": self.whirl,
            "sense": self.sense,
        }


@dataclass(frozen=True)
class Campbell:
    """Modes over spindle speed (Campbell diagram)."""

    speeds: np.ndarray
    """Speeds [rad/s], rising."""
    branches: tuple[tuple[Mode, ...], ...]
    """Modes tracked by shape, one tuple per mode and one entry per speed.

    Tuples are ordered by frequency at the first speed.
    """
    critical: tuple[tuple[float, Mode], ...]
    """Critical speeds [rad/s], at which a mode's frequency equals the spindle speed, rising."""

    def report(self) -> dict[str, object]:
        """Return the diagram as JSON-able values."""
        return {
            "speeds": self.speeds.tolist(),
            "branches": [
                {
                    key: [getattr(mode, key) for mode in branch]
                    for key in ("frequency", "damping_ratio", "damped_frequency", "whirl")
                }
                for branch in self.branches
            ],
            "critical_speeds": [
                {"speed": speed, "sense": mode.sense} for speed, mode in self.critical
            ],
        }


@dataclass(frozen=True, repr=False)
class NaturalVibration(Presented):
    """Natural vibration of a scene; see ``ab_sim.modes``."""

    _picture = "modes"

    scene: str
    """Name of the scene."""
    linearised: Linearised
    """Equations of the deck around its rest position."""
    speed: float
    """Spindle speed of ``modes`` [rad/s]."""
    modes: tuple[Mode, ...]
    """Modes by frequency, one per coordinate."""
    over_speed: Campbell
    """Modes from 0 to ``spindle.max_speed``."""

    def _facts(self) -> dict[str, str]:
        frequencies = ", ".join(f"{mode.frequency:.4g}" for mode in self.modes)
        critical = ", ".join(f"{speed:.4g}" for speed, _ in self.over_speed.critical)
        return {
            "scene": self.scene,
            "speed": number(self.speed, "rad/s"),
            "frequencies": f"{frequencies} rad/s",
            "critical speeds": f"{critical} rad/s" if critical else "none",
        }

    def _columns(self) -> Columns:
        modes = self.modes
        return {
            "frequency": Column("rad/s", [mode.frequency for mode in modes]),
            "damping_ratio": Column("1", [mode.damping_ratio for mode in modes]),
            "damped_frequency": Column("rad/s", [mode.damped_frequency for mode in modes]),
            "whirl": Column("1", [mode.whirl for mode in modes]),
            "sense": Column(None, [mode.sense for mode in modes]),
            "moving": Column(None, [", ".join(moving(self.linearised, mode)) for mode in modes]),
        }

    def report(self) -> dict[str, object]:
        """Return all results as JSON-able values in SI units; see docs/reference/json.md."""
        about = self.linearised
        return {
            "scene": self.scene,
            "speed": self.speed,
            "coordinates": list(about.coordinates),
            "units": list(about.units),
            "rest": list(about.rest),
            "averaging": AVERAGING,
            "modes": [mode.report() for mode in self.modes],
            "over_speed": self.over_speed.report(),
            "version": __version__,
        }


def vibration_of(scene: Scene, speed: float = 0.0) -> NaturalVibration:
    """Return a scene's modes at a speed [rad/s], and from 0 to ``spindle.max_speed``.

    Raises
    ------
    SceneError
        The deck has no rest position.
    """
    about = linearised(system_of(scene))
    over_speed = campbell(about, np.linspace(0.0, scene.spindle.max_speed, SPEEDS))
    return NaturalVibration(scene.name, about, speed, modes_of(about, speed), over_speed)


def campbell(about: Linearised, speeds: np.ndarray) -> Campbell:
    """Track modes over speed: modes with the most similar shapes belong together.

    Parameters
    ----------
    about
        Linearised equations of the deck.
    speeds
        At least two rising speeds [rad/s].
    """
    rows = [modes_of(about, float(speeds[0]))]
    for speed in speeds[1:]:
        rows.append(_followed(about, rows[-1], float(speed)))
    branches = tuple(zip(*rows, strict=True))
    critical = []
    for branch in branches:
        above = np.array([mode.frequency for mode in branch]) - speeds
        for k in np.flatnonzero((above[:-1] * above[1:] < 0.0) | (above[1:] == 0.0)):
            critical.append(_critical(about, branch[k], float(speeds[k]), float(speeds[k + 1])))
    return Campbell(
        speeds, branches, tuple(sorted(critical, key=lambda speed_and_mode: speed_and_mode[0]))
    )


def _followed(about: Linearised, before: tuple[Mode, ...], speed: float) -> tuple[Mode, ...]:
    """Return the modes at a speed [rad/s], in the order of the most similar modes ``before``.

    All modes are assigned together, so that no two of them continue the same mode where branches
    cross.
    """
    modes = modes_of(about, speed)
    order = linear_sum_assignment(modal_assurance(about, before, modes), maximize=True)[1]
    return tuple(modes[k] for k in order)


def _critical(about: Linearised, mode: Mode, low: float, high: float) -> tuple[float, Mode]:
    """Locate the critical speed of a mode between two speeds [rad/s].

    Returns
    -------
    tuple[float, Mode]
        The speed at which the mode's frequency equals the spindle's [rad/s], and the mode there.
    """

    def at(speed: float) -> Mode:
        modes = modes_of(about, speed)
        return modes[int(np.argmax(modal_assurance(about, (mode,), modes)))]

    speed = float(brentq(lambda w: at(w).frequency - w, low, high, xtol=1e-9))
    return speed, at(speed)


def modal_assurance(about: Linearised, ones: Sequence[Mode], others: Sequence[Mode]) -> np.ndarray:
    """Return the similarity of the shapes of modes: 1 if equal, 0 if orthogonal.

    It is the modal assurance criterion, weighted by the mass matrix. The result has shape (ones,
    others).
    """
    p, q = (np.array([mode.shape for mode in modes]) for modes in (ones, others))
    sizes = [np.einsum("ki,ij,kj->k", r.conj(), about.mass, r).real for r in (p, q)]
    return np.abs(p.conj() @ about.mass @ q.T) ** 2 / np.outer(*sizes)


def moving(about: Linearised, mode: Mode) -> tuple[str, ...]:
    """Return the names of a mode's coordinates by falling kinetic energy.

    Coordinates with a share of the energy below ``MATTERS`` are left out.
    """
    energy = np.diag(about.mass) * np.abs(mode.shape) ** 2
    share = energy / energy.sum()
    return tuple(about.coordinates[k] for k in np.argsort(-share) if share[k] >= MATTERS)


def modes_of(about: Linearised, speed: float) -> tuple[Mode, ...]:
    """Return the modes at a spindle speed [rad/s] by frequency, one per coordinate."""
    values, vectors = np.linalg.eig(about.matrix(speed))
    values = np.where(np.abs(values) <= ZERO * np.abs(values).max(), 0.0, values)
    # In coordinates p = L^T q with M = L L^T, |p|^2 is proportional to the kinetic energy.
    root = np.linalg.cholesky(about.mass).T
    shapes = root @ vectors[: len(root)]
    shapes = shapes / np.linalg.norm(shapes, axis=0)
    back = np.linalg.inv(root)
    whirl = back.T @ _whirling(about) @ back
    pairs = [*_swinging(values, shapes, whirl), *_creeping(values, shapes)]
    modes = [_mode(about, pair, back @ shape, speed) for pair, shape in pairs]
    scale = max(mode.frequency for mode in modes) or 1.0
    return tuple(sorted(modes, key=lambda m: (round(m.frequency / scale, 9), m.whirl)))


Pair = tuple[complex, complex]
"""Two eigenvalues of one mode [1/s]: conjugates, or two real ones, the slower first."""


def _swinging(
    values: np.ndarray, shapes: np.ndarray, whirl: np.ndarray
) -> Iterator[tuple[Pair, np.ndarray]]:
    """Yield the oscillating modes: pairs of conjugate eigenvalues, each with its shape.

    Parameters
    ----------
    values
        Eigenvalues [1/s], shape (2 n,).
    shapes
        Shapes in coordinates of equal energy, one per column, shape (n, 2 n).
    whirl
        Matrix of the mean whirl in these coordinates, shape (n, n).
    """
    for group in _equal(values, np.flatnonzero(values.imag > 0.0)):
        basis = _orthogonal(shapes[:, group])
        if len(group) > 1 and basis is not None:
            # Any basis of a repeated eigenvalue's space is valid. Diagonalising the whirl in it
            # separates forward from backward motion.
            basis = basis @ np.linalg.eigh(basis.conj().T @ whirl @ basis)[1]
        for k, value in enumerate(values[group]):
            shape = shapes[:, group[k]] if basis is None else basis[:, k]
            yield (complex(value), complex(value.conjugate())), shape


def _creeping(values: np.ndarray, shapes: np.ndarray) -> Iterator[tuple[Pair, np.ndarray]]:
    """Yield the overdamped modes: pairs of real eigenvalues, each with the slower one's shape.

    Eigenvalues with the most similar shapes form a pair. Arguments are those of ``_swinging``.
    """
    real = np.flatnonzero(values.imag == 0.0)
    shapes = shapes.copy()
    for group in _equal(values, real):
        basis = _orthogonal(shapes[:, group])
        if basis is not None:
            shapes[:, group] = basis
    real = real[np.argsort(np.abs(values[real]), kind="stable")]
    # Offset by 1, so that 0 marks shapes that are already paired.
    like = np.triu(np.abs(shapes[:, real].conj().T @ shapes[:, real]) + 1.0, 1)
    while like.any():
        slow, fast = np.unravel_index(np.argmax(like), like.shape)
        like[[slow, fast]] = like[:, [slow, fast]] = 0.0
        pair = complex(values[real[slow]]), complex(values[real[fast]])
        yield pair, shapes[:, real[slow]]


def _equal(values: np.ndarray, among: np.ndarray) -> list[np.ndarray]:
    """Return groups of indices, out of ``among``, of eigenvalues that are equal within rounding."""
    scale, groups, remaining = np.abs(values).max(), [], list(among)
    while remaining:
        near = [k for k in remaining if abs(values[k] - values[remaining[0]]) <= _EQUAL * scale]
        groups.append(np.array(near))
        remaining = [k for k in remaining if k not in near]
    return groups


def _orthogonal(shapes: np.ndarray) -> np.ndarray | None:
    """Return an orthonormal basis of the span of shapes, which are columns, shape (n, m).

    None if they are linearly dependent, as for a defective eigenvalue.
    """
    basis, size, _ = np.linalg.svd(shapes, full_matrices=False)
    return basis if shapes.shape == basis.shape and size[-1] > 1e-6 else None


def _whirling(about: Linearised) -> np.ndarray:
    """Return the Hermitian matrix H of the mean whirl, shape (n, n).

    A mode of shape q has the degree of whirl q^H H q / q^H diag(M) q, see ``Mode.whirl``.
    """
    matrix = np.zeros(about.mass.shape, complex)
    for x, y in about.across:
        matrix[x, y] = 1j * np.sqrt(about.mass[x, x] * about.mass[y, y])
        matrix[y, x] = -matrix[x, y]
    return matrix


def _mode(about: Linearised, pair: Pair, q: np.ndarray, speed: float) -> Mode:
    """Return the mode with two eigenvalues and a shape q, scaled to a largest entry of 1."""
    whirl = (q.conj() @ _whirling(about) @ q).real / (np.diag(about.mass) @ np.abs(q) ** 2)
    size = np.abs(q)
    # Take the first of several equal entries, independent of rounding.
    largest = np.argmax(size > (1.0 - _EQUAL) * size.max())
    return Mode(pair, q / q[largest], float(-whirl if speed < 0.0 else whirl))
