"""Floquet multipliers of a scene's periodic solution: whether it is stable, and how firmly."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

import ab_sim
from ab_sim.analysis.floquet.starts import STARTS, find_orbit
from ab_sim.analysis.floquet.turn import MOST, Orbit, TurnMap, within_turn
from ab_sim.analysis.held_speed import last_speed
from ab_sim.analysis.rest import rest_of
from ab_sim.dynamics.system import RACE_HEIGHT
from ab_sim.errors import InputError, nearest
from ab_sim.scene.model import Scene

CONVERGED = 1e-10
"""What half the step may change of a multiplier; as long as it does more, steps are halved."""
UNDECIDED = 1e-8
"""How near to 1 the largest modulus says nothing about stability."""
STILL = 1e-7
"""A deck that keeps within so much of where it hangs, in the units of ``TurnMap.scale``, is
balanced."""
STRUCTURAL = 1e-6
"""How near to 1 a multiplier of a balanced set of solutions has to be, to belong to the set."""
SAMPLES = 8192
"""Of what a turn is looked through for, between the steps by its Fourier series."""


@dataclass(frozen=True)
class Stability:
    """A periodic solution and its multipliers."""

    scene: str
    speed: float
    """w [rad/s]."""
    period: float
    """T, one turn of the spindle [s]."""
    found_from: str
    """Which start Newton's method found it from: start, balanced, settled; or a neighbour."""
    state_names: tuple[str, ...]
    orbit: Orbit
    multipliers: np.ndarray
    """Complex, by modulus, the largest first; shape (2 (K + n),)."""
    difference: float
    """What halving the step changed of them at most."""
    balanced: bool
    """The deck keeps still where it hangs."""
    structural: int
    """How many of the multipliers belong to the balanced set as such, and are 1: of more than two
    balls on a race the balanced positions form a manifold, of n - 2 dimensions."""
    angles: np.ndarray
    """Of the balls at the start [rad], within +-pi; shape (n,)."""
    ball_turns: np.ndarray
    """Turns that each ball makes relative to the rotor, each turn of the spindle; shape (n,)."""
    ball_swing: np.ndarray
    """From a ball's least to its largest angle [rad], but for its turns; shape (n,)."""
    whirl: tuple[float, float]
    """Smallest and largest over the turn [m], across the shaft, from where the deck hangs."""

    @property
    def largest(self) -> float:
        """Modulus of the largest multiplier, structural ones left out; 0 where there is none."""
        return _largest(self.multipliers, self.structural)

    @property
    def stable(self) -> bool | None:
        """Whether what is near comes back; None where the linear test decides nothing."""
        if abs(self.largest - 1.0) <= max(UNDECIDED, self.difference):
            return None
        return self.largest < 1.0

    @property
    def verdict(self) -> str:
        """stable, unstable or undecided."""
        return {True: "stable", False: "unstable", None: "undecided"}[self.stable]

    def report(self) -> dict[str, object]:
        """Everything as JSON-able values, SI units: see ``ab-sim floquet --help``."""
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
            "version": ab_sim.__version__,
        }


def none_found(scene: Scene, speed: float) -> dict[str, Any]:
    """The report of a search that found nothing."""
    return {
        "scene": scene.name,
        "found": False,
        "speed": speed,
        "multipliers": None,
        "largest": None,
        "stable": None,
        "version": ab_sim.__version__,
    }


def held_speed(scene: Scene) -> float:
    """The speed that a scene keeps in the end [rad/s].

    Raises:
        InputError: that is 0.
    """
    speed = last_speed(scene)
    if speed == 0.0:
        raise InputError(
            f"{scene.name}: its spindle stands in the end, and the solutions looked for repeat "
            "with every turn of it; give a speed [rad/s]"
        )
    return speed


def solutions_of(scene: Scene, speed: float | None = None, start: str = "") -> list[Stability]:
    """Periodic solutions of a scene at a held speed that are found, and their multipliers.

    Args:
        scene: what moves; its profile says no more than the speed.
        speed: w [rad/s]; default: the one that the scene keeps in the end.
        start: which of ``STARTS`` to search from; default: from each. Of equal balls that start
            side by side neither ever leaves the other, so then the balanced one comes first.

    Returns:
        Different ones, in the order of their starts; none where none was found.

    Raises:
        SceneError, InputError: see ``TurnMap``; or there is no such start.
    """
    turn = TurnMap(scene, held_speed(scene) if speed is None else speed)
    found: list[Stability] = []
    for name in _names(start, turn):
        orbit, _ = find_orbit(turn, (name,))
        one = None if orbit is None else judged(turn, orbit, name)
        if one is not None and not any(_same(turn, one, other) for other in found):
            found.append(one)
    return found


def _names(start: str, turn: TurnMap) -> list[str]:
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
    """Whether two solutions differ by no more than which ball is where."""
    length = turn.scale[0]
    near = np.allclose(one.whirl, other.whirl, rtol=1e-6, atol=STILL * length)
    return near and apart(one.multipliers, other.multipliers) <= STRUCTURAL


def judged(turn: TurnMap, orbit: Orbit, name: str) -> Stability | None:
    """An orbit's multipliers, to the digits that halving the step leaves as they are.

    Args:
        turn: its map.
        orbit: found with any number of steps.
        name: what it was found from.

    Returns:
        None where it is not one of smaller steps as well.
    """
    multipliers, difference = multipliers_of(orbit), math.inf
    while difference > CONVERGED and 2 * orbit.steps <= MOST:
        finer = turn.shoot(orbit.start, 2 * orbit.steps)
        if finer is None:
            return None
        before, multipliers = multipliers, multipliers_of(finer)
        difference = apart(before, multipliers)
        orbit = finer._replace(iterations=orbit.iterations + finer.iterations)
    layout = turn.layout
    angles = orbit.states[:, layout.angles]
    turned = np.round((angles[-1] - angles[0]) / (2.0 * math.pi))
    mean = 2.0 * math.pi * turned * np.linspace(0.0, 1.0, len(angles))[:, None]
    swings = [between(each[:-1] - each[0]).real for each in (angles - mean).T]
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


def multipliers_of(orbit: Orbit) -> np.ndarray:
    """Eigenvalues of the monodromy matrix, by modulus, the largest first."""
    found = np.linalg.eigvals(orbit.monodromy).astype(complex)
    return found[np.lexsort((-found.imag, -found.real, -np.round(np.abs(found), 12)))]


def apart(ones: np.ndarray, others: np.ndarray) -> float:
    """How far apart two sets of multipliers are: the largest distance of those that match best."""
    distance = np.abs(ones[:, None] - others[None, :])
    return float(distance[linear_sum_assignment(distance)].max(initial=0.0))


def largest_of(turn: TurnMap, orbit: Orbit) -> float:
    """Largest modulus of an orbit's multipliers as its steps give them, structural ones left out.

    For maps of many; ``judged`` says besides how many digits of it are right.
    """
    multipliers = multipliers_of(orbit)
    structural = _structural(turn, multipliers) if _keeps_still(turn, orbit) else 0
    return _largest(multipliers, structural)


def _largest(multipliers: np.ndarray, structural: int) -> float:
    nearest_to_one = np.argsort(np.abs(multipliers - 1.0), kind="stable")[:structural]
    return float(np.abs(np.delete(multipliers, nearest_to_one)).max(initial=0.0))


def _keeps_still(turn: TurnMap, orbit: Orbit) -> bool:
    own = turn.layout.deck
    away = np.abs(orbit.states[:, own] - turn.rest()) / turn.scale[own]
    return bool(away.max() <= STILL)


def _structural(turn: TurnMap, multipliers: np.ndarray) -> int:
    """How many of the multipliers say no more than that balanced positions form a manifold."""
    n, heights = len(turn.system.balls), turn.system.balls[:, RACE_HEIGHT]
    races = np.unique(heights, return_counts=True)[1] if turn.scene.deck is not None else [n]
    free = sum(max(0, int(balls) - 2) for balls in races)
    if n and turn.scene.deck is None and turn.system.deck_model.unbalance == 0.0:
        free = max(free, 1)  # Balls that balance nothing but each other can sit anywhere.
    return min(free, int(np.sum(np.abs(multipliers - 1.0) <= STRUCTURAL)))


def _whirl(turn: TurnMap, orbit: Orbit) -> tuple[float, float]:
    """Smallest and largest distance of C from where it hangs, across the shaft, over a turn [m]."""
    deck_model, own = turn.system.deck_model, turn.layout.deck
    psi = turn.scene.start.angle + turn.speed * turn.period * np.linspace(0, 1, orbit.steps + 1)
    x, y = deck_model.place(orbit.states[:, own], psi)[:-1, :2].T
    place = rest_of(turn.scene).place
    whirl = np.abs(between((x - place[0]) + 1j * (y - place[1])))
    return float(whirl.min()), float(whirl.max())


def between(values: np.ndarray) -> np.ndarray:
    """Values of what is periodic between those at even distances, by its Fourier series.

    Args:
        values: real or complex, over one period whose end is left out.

    Returns:
        ``SAMPLES`` of them, or as many as there were if these are more; complex.
    """
    waves, count = np.fft.fft(values), len(values)
    many, half = max(SAMPLES, count), (count + 1) // 2
    spread = np.zeros(many, complex)
    spread[:half], spread[-(count - half) :] = waves[:half], waves[half:]
    return np.fft.ifft(spread) * (many / count)
