"""Exact motion of circulating balls: periodic solutions with the beat of bunch and spindle.

In axes that turn with the rotor the equations do not depend on time. A bunch with mean speed s
circulates once around the race in T = 2 pi / (w - s). The state is then the same except for the
angles of the bunch: P_T(y) = y - 2 pi for its balls. T is unknown, and the phase is arbitrary, so
that one multiplier is 1.

The period joins the state as an unknown of Newton's method, which starts from the closed form
(``analysis.circulating``).

Source: Nayfeh and Balachandran, Applied Nonlinear Dynamics (1995), 6.5.1 (autonomous systems).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ab_sim.analysis.circulating import CirculatingBunch, reason_not_covered, state_of_bunch
from ab_sim.analysis.floquet.stability import CONVERGED, UNDECIDED
from ab_sim.analysis.floquet.turn import FARTHEST, FLAT, MOST, TurnMap, newton
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
        """Multipliers by falling modulus, complex, shape (states - 1,).

        The multiplier that is 1 because of the free phase is left out.
        """
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

    Steps are halved until the period changes by less than ``CONVERGED``, relative to its length.

    Parameters
    ----------
    scene
        Planar scene, of which the closed form gave the bunch.
    bunch
        Bunch by the closed form, the first guess of Newton's method.

    Raises
    ------
    SceneError
        The closed form does not cover the scene, or the scene has friction.
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

    Parameters
    ----------
    scene
        Planar scene.
    speed
        Spindle speed w [rad/s].
    count
        Number of circulating balls; they are the first ones.

    Raises
    ------
    SceneError
        The closed form does not cover the scene, or the scene has friction.
    """

    def __init__(self, scene: Scene, speed: float, count: int) -> None:
        if (reason := reason_not_covered(scene)) is not None:
            raise SceneError(f"cannot search for circulating balls: {reason}")
        self.turn, self.count, self.speed = TurnMap(scene, speed), count, speed
        self._field = held(scene, speed)
        self._round = np.zeros(self.turn.layout.size)
        self._round[self.turn.layout.angles][:count] = -math.copysign(2.0 * math.pi, speed)

    def steps(self, period: float) -> int:
        """Return the least number of steps for a period [s], at the step of ``TurnMap``."""
        return math.ceil(self.turn.fewest * period / self.turn.period)

    def gap(self, states: np.ndarray) -> np.ndarray:
        """Return the gap P_T(y) - y without the bunch's revolution, shape (states,).

        Parameters
        ----------
        states
            States of one period, from its start to its end, shape (steps + 1, states).
        """
        gap: np.ndarray = states[-1] - states[0] - self._round
        return gap

    def shoot(self, state: np.ndarray, period: float, steps: int) -> CirculatingSolution | None:
        """Return the periodic solution near a guess; None if Newton's method does not converge.

        Parameters
        ----------
        state
            State at the start, shape (states,).
        period
            Period T [s].
        steps
            Number of steps in a period.
        """

        def trial(
            guess: tuple[np.ndarray, float], _: int
        ) -> tuple[CirculatingSolution, float, Callable[[], tuple[np.ndarray, float] | None]]:
            state, period = guess
            flown = self.turn.integrate(state, period, steps)
            solution = CirculatingSolution(
                self.speed, self.count, period, flown.states, flown.matrix
            )
            residual = float(np.abs(self.gap(flown.states) / self.turn.scale).max())
            return solution, residual, lambda: self._step(solution)

        return newton(trial, (state, period))

    def _step(self, solution: CirculatingSolution) -> tuple[np.ndarray, float] | None:
        """Return state and period after a Newton step; None if the step is not usable.

        The system has one unknown more than equations, because the phase is arbitrary. The
        least-squares step of minimal norm does not shift the solution in time.
        """
        state, period, gap = solution.states[0], solution.period, self.gap(solution.states)
        slope = self._field.slope(0.0, solution.states[-1])
        scale = np.append(self.turn.scale, period)
        matrix = np.column_stack([solution.monodromy - np.eye(len(gap)), slope])
        matrix = matrix * scale / self.turn.scale[:, None]
        change = scale * np.linalg.lstsq(matrix, -gap / self.turn.scale, rcond=FLAT)[0]
        # The change of the period is limited to a tenth of it, so that the period stays positive.
        farthest = np.abs(change[self.turn.layout.angles]).max()
        farthest = max(farthest, 10.0 * FARTHEST * abs(change[-1] / period))
        if not math.isfinite(farthest):
            return None
        share = min(1.0, FARTHEST / max(float(farthest), 1e-300))
        return state + share * change[:-1], period + float(share * change[-1])
