"""Balls that circulate, exactly: periodic solutions with the beat of bunch and spindle.

In axes that turn with the rotor nothing depends on time. A bunch that turns at s in the mean comes
round the race once in T = 2 pi / (w - s), and all is as it was but for its angle: P_T(y) = y - 2 pi
on the bunch's balls. T is not known, and time may begin anywhere: of the multipliers one is 1.

Newton's method begins at the closed form (``analysis.circulating``), with T unknown, or with s
given and the spindle's speed or another parameter unknown: over s a branch goes on across its
folds.

Source: Nayfeh and Balachandran, Applied Nonlinear Dynamics (1995), 6.5.1 (autonomous systems).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ab_sim.analysis.circulating import CirculatingBunch, state_of_bunch, why_not
from ab_sim.analysis.floquet.stability import CONVERGED, UNDECIDED
from ab_sim.analysis.floquet.turn import CLOSED, FARTHEST, FLAT, MOST, NEWTON, ROUNDED, TurnMap
from ab_sim.analysis.held_speed import held
from ab_sim.errors import SceneError
from ab_sim.scene.model import Scene

APART = 1e-6
"""Relative distance of two values of a parameter that a derivative is taken from."""

Case = Callable[[float], tuple[Scene, float]]
"""The scene and its spindle speed [rad/s] for a value of a parameter."""


@dataclass(frozen=True)
class CirculatingSolution:
    """A periodic solution in which a bunch comes round the race once."""

    spindle_speed: float
    """w [rad/s]."""
    count: int
    """The first balls, so many, circulate."""
    period: float
    """T [s]."""
    states: np.ndarray
    """On the rotor's axes, at the start and after each step, shape (steps + 1, states)."""
    monodromy: np.ndarray
    """Shape (states, states)."""
    value: float
    """Of the parameter: the spindle's speed where T was unknown."""

    @property
    def speed(self) -> float:
        """s of the bunch in the mean, absolute [rad/s]."""
        return self.spindle_speed - math.copysign(2.0 * math.pi / self.period, self.spindle_speed)

    @property
    def multipliers(self) -> np.ndarray:
        """By modulus, the largest first, without the one that is 1; complex, (states - 1,)."""
        values = np.linalg.eigvals(self.monodromy)
        values = np.delete(values, int(np.argmin(np.abs(values - 1.0))))
        return np.asarray(values[np.argsort(-np.abs(values))], complex)

    @property
    def largest(self) -> float:
        """Modulus of the largest multiplier."""
        return float(np.abs(self.multipliers[0]))

    @property
    def stable(self) -> bool | None:
        """Whether small disturbances decay; None where the linear test decides nothing."""
        return None if abs(self.largest - 1.0) <= UNDECIDED else self.largest < 1.0

    @property
    def whirl(self) -> tuple[float, float]:
        """Smallest and largest |u| at the steps [m]."""
        W = np.hypot(self.states[:, 0], self.states[:, 1])
        return float(W.min()), float(W.max())

    def report(self) -> dict[str, object]:
        """As JSON-able values, SI units."""
        return {
            "speed": self.speed,
            "period": self.period,
            "largest": self.largest,
            "stable": self.stable,
            "whirl_min": self.whirl[0],
            "whirl_max": self.whirl[1],
        }


def circulating_solution(scene: Scene, bunch: CirculatingBunch) -> CirculatingSolution | None:
    """The periodic solution near a bunch of the closed form; None where none is found.

    Steps are halved until its period does not change any more.

    Args:
        scene: the bunch's.
        bunch: where to begin.

    Raises:
        SceneError: the closed form does not know the scene, or it has friction.
    """
    speed = bunch.spindle_speed
    beat = BeatMap(scene, speed, bunch.count)
    state, period = (
        state_of_bunch(beat.turn.system, bunch),
        2.0 * math.pi / abs(speed - bunch.speed),
    )
    steps, found = beat.steps(period), None
    while steps <= MOST:
        before, found = found, beat.shoot(state, period, steps)
        if found is None:
            return None
        if before is not None and abs(found.period - before.period) <= CONVERGED * found.period:
            return found
        state, period, steps = found.states[0], found.period, 2 * steps
    return None


def solution_at(case: Case, near: CirculatingSolution, speed: float) -> CirculatingSolution | None:
    """The solution whose bunch turns at a speed, at whatever value of a parameter that is.

    Args:
        case: what the parameter means.
        near: a solution that belongs to ``case(near.value)``.
        speed: s in the mean [rad/s].

    Raises:
        SceneError, InputError: a value makes no scene, or one without a beat map.
    """
    state, value, count = near.states[0].copy(), near.value, near.count
    steps, best, missed = len(near.states) - 1, None, math.inf
    for _ in range(NEWTON):
        scene, w = case(value)
        beat = BeatMap(scene, w, count)
        period = 2.0 * math.pi / abs(w - speed)
        flown = beat.turn.over(state, period, steps)
        gap = beat.gap(flown.states)
        now = float(np.abs(gap / beat.turn.scale).max())
        if not math.isfinite(now) or (missed < CLOSED and now >= 0.5 * missed):
            return best
        best = CirculatingSolution(w, count, period, flown.states, flown.matrix, value)
        missed = now
        if missed <= ROUNDED:
            return best
        other = value * (1.0 + APART)
        scene, w = case(other)
        there = BeatMap(scene, w, count)
        moved = there.turn.over(state, 2.0 * math.pi / abs(w - speed), steps, columns=0)
        slope = (there.gap(moved.states) - gap) / (other - value)
        state, changed = beat.step(state, flown.matrix, gap, slope, value)
        value += changed
    return best if missed < CLOSED else None


class BeatMap:
    """P_T of a scene at a held speed.

    Args:
        scene: what moves, in the plane.
        speed: w [rad/s].
        count: how many balls come round, the first ones.

    Raises:
        SceneError: the closed form does not know the scene, or it has friction.
    """

    def __init__(self, scene: Scene, speed: float, count: int) -> None:
        if (reason := why_not(scene)) is not None:
            raise SceneError(f"balls that circulate are not looked for: {reason}")
        self.turn, self.count, self.speed = TurnMap(scene, speed), count, speed
        self._field = held(scene, speed)
        self._round = np.zeros(self.turn.layout.size)
        self._round[self.turn.layout.angles][:count] = -math.copysign(2.0 * math.pi, speed)

    def steps(self, period: float) -> int:
        """That a period has to be cut into, at least."""
        return math.ceil(self.turn.fewest * period / self.turn.period)

    def gap(self, states: np.ndarray) -> np.ndarray:
        """What a start misses by after a period, shape (states,)."""
        missed: np.ndarray = states[-1] - states[0] - self._round
        return missed

    def shoot(self, state: np.ndarray, period: float, steps: int) -> CirculatingSolution | None:
        """The periodic solution near a guess; None where Newton's method finds none.

        Args:
            state: at the start.
            period: T [s].
            steps: in a period.
        """
        best, missed = None, math.inf
        for _ in range(NEWTON):
            flown = self.turn.over(state, period, steps)
            gap = self.gap(flown.states)
            now = float(np.abs(gap / self.turn.scale).max())
            if not math.isfinite(now) or (missed < CLOSED and now >= 0.5 * missed):
                return best
            missed = now
            best = CirculatingSolution(
                self.speed, self.count, period, flown.states, flown.matrix, self.speed
            )
            if missed <= ROUNDED:
                return best
            slope = self._field.slope(0.0, flown.states[-1])
            state, changed = self.step(state, flown.matrix, gap, slope, period)
            period += changed
            if not 0.0 < period < math.inf:
                return None
        return best if missed < CLOSED else None

    def step(
        self, state: np.ndarray, matrix: np.ndarray, gap: np.ndarray, slope: np.ndarray, size: float
    ) -> tuple[np.ndarray, float]:
        """Newton's step, the shortest one: the state after it, and what the unknown changes by.

        Args:
            state: at the start.
            matrix: what a period makes of small changes of it.
            gap: what it misses by.
            slope: of the gap over the other unknown.
            size: of the other unknown.
        """
        scale = np.append(self.turn.scale, abs(size))
        ways = np.column_stack([matrix - np.eye(len(gap)), slope])
        ways = ways * scale / self.turn.scale[:, None]
        change = scale * np.linalg.lstsq(ways, -gap / self.turn.scale, rcond=FLAT)[0]
        farthest = np.abs(change[self.turn.layout.angles]).max()
        farthest = max(farthest, 10.0 * FARTHEST * abs(change[-1] / size))
        if not math.isfinite(farthest):
            return state * math.nan, math.nan
        share = min(1.0, FARTHEST / max(float(farthest), 1e-300))
        return state + share * change[:-1], float(share * change[-1])
