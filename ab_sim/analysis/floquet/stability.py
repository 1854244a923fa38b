"""Floquet multipliers of a scene's periodic solution."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from ab_sim.analysis.floquet.turn import MOST, STARTS, Orbit, TurnMap, find_orbit, within_turn
from ab_sim.analysis.held_speed import last_speed
from ab_sim.analysis.rest import rest_of
from ab_sim.base.errors import InputError, nearest
from ab_sim.base.version import __version__
from ab_sim.model.dynamics.system import HEIGHT
from ab_sim.scene.model import Scene

CONVERGED = 1e-10
"""Largest change of a multiplier at which halving the steps ends."""
UNDECIDED = 1e-8
"""Distance from 1 below which the largest modulus is reported as undecided.

A double multiplier at 1 moves by about the square root of rounding, 1e-8.
"""
STILL = 1e-7
"""Tolerance for a balanced deck: distance from its rest position in units of ``TurnMap.scale``."""
_STRUCTURAL = 1e-6
"""Largest distance from 1 of a multiplier that belongs to a manifold of balanced solutions."""
SAMPLES = 8192
"""Number of samples of a turn, after interpolation between steps by a Fourier series."""


@dataclass(frozen=True)
class Stability:
    """Periodic solution of a scene at a constant speed, with its Floquet multipliers."""

    scene: str
    speed: float
    """Spindle speed w [rad/s]."""
    period: float
    """Period T, one turn of the spindle [s]."""
    found_from: str
    """Origin of Newton's first guess: a name in ``STARTS``, or ``follow.NEIGHBOUR``."""
    state_names: tuple[str, ...]
    """Names of the states in the order of ``orbit.states``."""
    orbit: Orbit
    """Periodic solution with the final number of steps."""
    multipliers: np.ndarray
    """Multipliers, complex, by falling modulus, shape (2 (K + n),)."""
    difference: float
    """Largest change of a multiplier when the step was halved."""
    balanced: bool
    """True if the deck stays at its rest position."""
    structural: int
    """Number of multipliers that are 1 because the balanced positions form a manifold.

    With n > 2 balls on a race the manifold has n - 2 dimensions.
    """
    angles: np.ndarray
    """Ball angles at the start [rad], within +-pi, shape (n,)."""
    ball_turns: np.ndarray
    """Revolutions of each ball relative to the rotor per spindle revolution, shape (n,)."""
    ball_swing: np.ndarray
    """Range of each ball's angle over the turn [rad], whole revolutions left out, shape (n,)."""
    whirl: tuple[float, float]
    """Smallest and largest whirl over the turn [m], across the shaft, from the rest position."""

    @property
    def largest(self) -> float:
        """Modulus of the largest multiplier without structural ones; 0 if there is none."""
        return _largest(self.multipliers, self.structural)

    @property
    def stable(self) -> bool | None:
        """True if small disturbances decay; None if the linear test is undecided."""
        if abs(self.largest - 1.0) <= max(UNDECIDED, self.difference):
            return None
        return self.largest < 1.0

    @property
    def verdict(self) -> str:
        """Verdict as text: ``stable``, ``unstable`` or ``undecided``."""
        return {True: "stable", False: "unstable", None: "undecided"}[self.stable]

    def report(self) -> dict[str, object]:
        """Return all results as JSON-able values in SI units; see docs/reference/json.md."""
        return {
            "scene": self.scene,
            "found": True,
            "found_from": self.found_from,
            "speed": self.speed,
            "period": self.period,
            "multipliers": [[float(x.real), float(x.imag)] for x in self.multipliers],
            "largest": self.largest,
            "structural_ones": self.structural,
            "stable": self.stable,
            "verdict": self.verdict,
            "balanced": self.balanced,
            "whirl_min": self.whirl[0],
            "whirl_max": self.whirl[1],
            "ball_angles": self.angles.tolist(),
            "ball_turns": self.ball_turns.tolist(),
            "ball_swing": self.ball_swing.tolist(),
            "start": self.orbit.start.tolist(),
            "state_names": list(self.state_names),
            "residual": self.orbit.residual,
            "iterations": self.orbit.iterations,
            "steps": self.orbit.steps,
            "halved_step_difference": self.difference,
            "version": __version__,
        }


def none_found(scene: Scene, speed: float) -> dict[str, Any]:
    """Return the report of a search at a speed [rad/s] that found no periodic solution."""
    return {
        "scene": scene.name,
        "found": False,
        "speed": speed,
        "multipliers": None,
        "largest": None,
        "stable": None,
        "version": __version__,
    }


def held_speed(scene: Scene) -> float:
    """Return the final speed of a scene [rad/s].

    Raises
    ------
    InputError
        The final speed is 0.
    """
    speed = last_speed(scene)
    if speed == 0.0:
        raise InputError(
            f"{scene.name}: the spindle stands still at the end, but a periodic solution repeats "
            "with its turns; give a speed [rad/s]"
        )
    return speed


def solutions_of(scene: Scene, speed: float | None = None, start: str = "") -> list[Stability]:
    """Return the periodic solutions found for a scene at a constant speed, with multipliers.

    Parameters
    ----------
    scene
        Scene; its profile only supplies the speed.
    speed
        Spindle speed w [rad/s]; default: the final speed of the scene.
    start
        Name in ``STARTS``; default: all. Equal balls that start at one place never separate, so
        ``balanced`` is then tried first.

    Returns
    -------
    list[Stability]
        Distinct solutions in the order of their starts; empty if none was found.

    Raises
    ------
    SceneError, InputError
        See ``TurnMap``; or the start is unknown.
    """
    turn = TurnMap(scene, held_speed(scene) if speed is None else speed)
    solutions: list[Stability] = []
    for name in _names(start, turn):
        orbit, _ = find_orbit(turn, (name,))
        one = None if orbit is None else judged(turn, orbit, name)
        if one is not None and not any(_same(turn, one, other) for other in solutions):
            solutions.append(one)
    return solutions


def _names(start: str, turn: TurnMap) -> list[str]:
    """Return the names of the starts to be tried, in order; see ``solutions_of``."""
    if start:
        if start not in STARTS:
            raise InputError(
                f"start {start!r}: must be one of {', '.join(STARTS)}{nearest(start, STARTS)}"
            )
        return [start]
    angles = np.sort(turn.scene_start()[turn.layout.angles] % (2.0 * math.pi))
    together = bool((np.diff(angles) < 1e-9).any())
    return sorted(STARTS, key=lambda name: name != "balanced") if together else [*STARTS]


def _same(turn: TurnMap, one: Stability, other: Stability) -> bool:
    """Return whether two solutions are equal up to an exchange of balls."""
    length = turn.scale[0]
    near = np.allclose(one.whirl, other.whirl, rtol=1e-6, atol=STILL * length)
    return near and multiplier_distance(one.multipliers, other.multipliers) <= _STRUCTURAL


def judged(turn: TurnMap, orbit: Orbit, name: str) -> Stability | None:
    """Return an orbit's stability; steps are halved until the multipliers no longer change.

    Parameters
    ----------
    turn
        Turn map of the orbit.
    orbit
        Orbit with any number of steps.
    name
        Origin of the orbit, for ``Stability.found_from``.

    Returns
    -------
    Stability | None
        The solution; None if it does not exist with smaller steps.
    """
    multipliers, difference = _multipliers_of(orbit), math.inf
    while difference > CONVERGED and 2 * orbit.steps <= MOST:
        finer = turn.shoot(orbit.start, 2 * orbit.steps)
        if finer is None:
            return None
        before, multipliers = multipliers, _multipliers_of(finer)
        difference = multiplier_distance(before, multipliers)
        orbit = finer._replace(iterations=orbit.iterations + finer.iterations)
    layout = turn.layout
    angles = orbit.states[:, layout.angles]
    turned = np.round((angles[-1] - angles[0]) / (2.0 * math.pi))
    mean = 2.0 * math.pi * turned * np.linspace(0.0, 1.0, len(angles))[:, None]
    swings = [_interpolate_periodic(swing[:-1] - swing[0]).real for swing in (angles - mean).T]
    balanced = _keeps_still(turn, orbit)
    return Stability(
        scene=turn.scene.name,
        speed=turn.speed,
        period=turn.period,
        found_from=name,
        state_names=layout.names,
        orbit=orbit,
        multipliers=multipliers,
        difference=difference,
        balanced=balanced,
        structural=_structural(turn, multipliers) if balanced else 0,
        angles=within_turn(angles[0]),
        ball_turns=turned.astype(int),
        ball_swing=np.array([np.ptp(swing) for swing in swings]),
        whirl=_whirl(turn, orbit),
    )


def _multipliers_of(orbit: Orbit) -> np.ndarray:
    """Return the eigenvalues of the monodromy matrix by falling modulus, shape (2 (K + n),)."""
    multipliers = np.linalg.eigvals(orbit.monodromy).astype(complex)
    # Moduli are rounded for sorting, so that conjugates stay next to each other.
    return multipliers[
        np.lexsort((-multipliers.imag, -multipliers.real, -np.round(np.abs(multipliers), 12)))
    ]


def multiplier_distance(ones: np.ndarray, others: np.ndarray) -> float:
    """Return the distance of two sets of multipliers with equal shapes (n,).

    Each multiplier is paired with one of the other set, with the least total distance. The result
    is the distance of the worst pair. Sorting would pair wrongly if moduli are nearly equal.
    """
    distance = np.abs(ones[:, None] - others[None, :])
    return float(distance[linear_sum_assignment(distance)].max(initial=0.0))


def largest_of(turn: TurnMap, orbit: Orbit) -> float:
    """Return the largest modulus of an orbit's multipliers, without structural ones.

    The multipliers are those of the orbit's steps, without a check of their accuracy, to save time
    in maps with many orbits. ``judged`` also checks the accuracy.
    """
    multipliers = _multipliers_of(orbit)
    structural = _structural(turn, multipliers) if _keeps_still(turn, orbit) else 0
    return _largest(multipliers, structural)


def _largest(multipliers: np.ndarray, structural: int) -> float:
    """Return the largest modulus without the ``structural`` multipliers nearest to 1."""
    nearest_to_one = np.argsort(np.abs(multipliers - 1.0), kind="stable")[:structural]
    return float(np.abs(np.delete(multipliers, nearest_to_one)).max(initial=0.0))


def _keeps_still(turn: TurnMap, orbit: Orbit) -> bool:
    """Return whether the deck stays within ``STILL`` of its rest position during the turn."""
    deck = turn.layout.deck
    away = np.abs(orbit.states[:, deck] - turn.rest()) / turn.scale[deck]
    return bool(away.max() <= STILL)


def _structural(turn: TurnMap, multipliers: np.ndarray) -> int:
    """Return the number of multipliers that are 1 because balanced positions form a manifold."""
    n, heights = len(turn.system.balls), turn.system.balls[:, HEIGHT]
    races = np.unique(heights, return_counts=True)[1] if turn.scene.deck is not None else [n]
    # Two equations of balance per race leave n - 2 free angles. A multiplier counts only if it is
    # near 1, because balls that cannot balance have no such manifold.
    free = sum(max(0, int(balls) - 2) for balls in races)
    if n and turn.scene.deck is None and turn.system.deck_model.unbalance == 0.0:
        free = max(free, 1)  # Without an unbalance all positions can be rotated.
    return min(free, int(np.sum(np.abs(multipliers - 1.0) <= _STRUCTURAL)))


def _whirl(turn: TurnMap, orbit: Orbit) -> tuple[float, float]:
    """Return the smallest and largest distance of C from its rest position across the shaft [m]."""
    deck_model, deck = turn.system.deck_model, turn.layout.deck
    psi = turn.scene.start.angle + turn.speed * turn.period * np.linspace(0, 1, orbit.steps + 1)
    x, y = deck_model.place(orbit.states[:, deck], psi)[:-1, :2].T
    place = rest_of(turn.scene).place
    whirl = np.abs(_interpolate_periodic((x - place[0]) + 1j * (y - place[1])))
    return float(whirl.min()), float(whirl.max())


def _interpolate_periodic(values: np.ndarray) -> np.ndarray:
    """Interpolate a periodic function between equidistant samples by its Fourier series.

    Parameters
    ----------
    values
        Real or complex samples of one period without its end.

    Returns
    -------
    np.ndarray
        Complex samples: ``SAMPLES``, or the number of ``values`` if that is larger.
    """
    waves, count = np.fft.fft(values), len(values)
    many, half = max(SAMPLES, count), (count + 1) // 2
    spread = np.zeros(many, complex)
    spread[:half], spread[-(count - half) :] = waves[:half], waves[half:]
    return np.fft.ifft(spread) * (many / count)
