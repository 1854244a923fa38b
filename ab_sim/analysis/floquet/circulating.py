"""Exact motion of circulating balls: periodic solutions with the beat of bunch and spindle.

In axes that turn with the rotor the equations do not depend on time. A bunch with mean speed s
circulates once around the race in T = 2 pi / (w - s). The state is then the same except for the
angles of the bunch: P_T(y) = y - 2 pi for its balls. T is unknown, and the phase is arbitrary, so
that one multiplier is 1.

Newton's method starts from the closed form (``analysis.circulating``).

Source: Nayfeh and Balachandran, Applied Nonlinear Dynamics (1995), 6.5.1 (autonomous systems).
"""

import math
from dataclasses import dataclass

import numpy as np

from ab_sim.analysis.circulating import CirculatingBunch, state_of_bunch, why_not
from ab_sim.analysis.floquet.stability import CONVERGED, UNDECIDED
from ab_sim.analysis.floquet.turn import CLOSED, FARTHEST, FLAT, MOST, NEWTON, ROUNDED, TurnMap
from ab_sim.analysis.held_speed import held
from ab_sim.base.errors import SceneError
from ab_sim.scene.model import Scene


@dataclass(frozen=True)
class CirculatingSolution:
    """Periodic solution in which a bunch circulates once around the race."""

    spindle_speed: float
    """Spindle speed w [rad/s]."""
    count: int
    """Number of circulating balls; they are the first ones."""
    period: float
    """Period T [s]."""
    states: np.ndarray
    """States on the rotor's axes, at the start and after each step, shape (steps + 1, states)."""
    monodromy: np.ndarray
    """Monodromy matrix, shape (states, states)."""

    @property
    def speed(self) -> float:
        """Mean absolute speed s of the bunch [rad/s]."""
        return self.spindle_speed - math.copysign(2.0 * math.pi / self.period, self.spindle_speed)

    @property
    def multipliers(self) -> np.ndarray:
        """Multipliers by falling modulus, without the one that is 1; complex, (states - 1,)."""
        values = np.linalg.eigvals(self.monodromy)
        values = np.delete(values, int(np.argmin(np.abs(values - 1.0))))
        return np.asarray(values[np.argsort(-np.abs(values))], complex)

    @property
    def largest(self) -> float:
        """Modulus of the largest multiplier."""
        return float(np.abs(self.multipliers[0]))

    @property
    def stable(self) -> bool | None:
        """True if small disturbances decay; None if the linear test is undecided."""
        return None if abs(self.largest - 1.0) <= UNDECIDED else self.largest < 1.0

    @property
    def whirl(self) -> tuple[float, float]:
        """Smallest and largest |u| at the steps [m]."""
        W = np.hypot(self.states[:, 0], self.states[:, 1])
        return float(W.min()), float(W.max())

    def report(self) -> dict[str, object]:
        """Return the solution as JSON-able values in SI units."""
        return {
            "speed": self.speed,
            "period": self.period,
            "largest": self.largest,
            "stable": self.stable,
            "whirl_min": self.whirl[0],
            "whirl_max": self.whirl[1],
        }


def circulating_solution(scene: Scene, bunch: CirculatingBunch) -> CirculatingSolution | None:
    """Return the periodic solution near a bunch of the closed form; None if none is found.

    Steps are halved until the period has converged.

    Args:
        scene: scene of the bunch.
        bunch: initial guess.

    Raises:
        SceneError: the closed form does not cover the scene, or the scene has friction.
    """
    speed = bunch.spindle_speed
    beat = BeatMap(scene, speed, bunch.count)
    state, period = (
        state_of_bunch(beat.turn.system, bunch),
        2.0 * math.pi / abs(speed - bunch.speed),
    )
    steps, solution = beat.steps(period), None
    while steps <= MOST:
        before, solution = solution, beat.shoot(state, period, steps)
        if solution is None:
            return None
        if (
            before is not None
            and abs(solution.period - before.period) <= CONVERGED * solution.period
        ):
            return solution
        state, period, steps = solution.states[0], solution.period, 2 * steps
    return None


class BeatMap:
    """Map P_T of the state over one beat, at a constant spindle speed.

    Args:
        scene: planar scene.
        speed: spindle speed w [rad/s].
        count: number of circulating balls; they are the first ones.

    Raises:
        SceneError: the closed form does not cover the scene, or the scene has friction.
    """

    def __init__(self, scene: Scene, speed: float, count: int) -> None:
        if (reason := why_not(scene)) is not None:
            raise SceneError(f"circulating balls are not looked for: {reason}")
        self.turn, self.count, self.speed = TurnMap(scene, speed), count, speed
        self._field = held(scene, speed)
        self._round = np.zeros(self.turn.layout.size)
        self._round[self.turn.layout.angles][:count] = -math.copysign(2.0 * math.pi, speed)

    def steps(self, period: float) -> int:
        """Return the least number of steps for a period."""
        return math.ceil(self.turn.fewest * period / self.turn.period)

    def gap(self, states: np.ndarray) -> np.ndarray:
        """Return end minus start of a period, without the bunch's revolution, shape (states,)."""
        missed: np.ndarray = states[-1] - states[0] - self._round
        return missed

    def shoot(self, state: np.ndarray, period: float, steps: int) -> CirculatingSolution | None:
        """Return the periodic solution near a guess; None if Newton's method does not converge.

        Args:
            state: state at the start.
            period: period T [s].
            steps: number of steps in a period.
        """
        best, missed = None, math.inf
        for _ in range(NEWTON):
            flown = self.turn.over(state, period, steps)
            gap = self.gap(flown.states)
            now = float(np.abs(gap / self.turn.scale).max())
            if not math.isfinite(now) or (missed < CLOSED and now >= 0.5 * missed):
                return best
            missed = now
            best = CirculatingSolution(self.speed, self.count, period, flown.states, flown.matrix)
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
        """Return the state after a Newton step, and the change of the other unknown.

        The system is singular along the shift in time; the least-squares step of minimal norm is
        taken.

        Args:
            state: state at the start.
            matrix: monodromy matrix.
            gap: gap after a period.
            slope: derivative of the gap by the other unknown.
            size: value of the other unknown, period or parameter; its scale.
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
