"""Outcome of an adaptive start-up: the controller's estimates and the true values."""

import math
from typing import NamedTuple

import numpy as np

from ab_sim.control import Belief, State
from ab_sim.drive.adaptive import AdaptiveRun, BeliefAt
from ab_sim.drive.balance import resultant
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene.model import Scene


class AdaptiveOutcome(NamedTuple):
    """Actions and estimates of a controller during a run."""

    state: State
    """State at the end."""
    words: str
    """Text for users: the controller's state at the end, and its reason."""
    belief: Belief
    """Estimates at the end."""
    beliefs: tuple[BeliefAt, ...]
    """Estimates at each command period, including the start."""

    @classmethod
    def of(cls, start_up: AdaptiveRun) -> "AdaptiveOutcome":
        """Return the outcome of a start-up so far."""
        controller = start_up.controller
        return cls(
            controller.state,
            controller.words,
            controller.belief,
            tuple(start_up.beliefs),
        )

    def report(self) -> dict[str, object]:
        """Return the outcome as JSON-able values in SI units; None for unknown values."""
        belief = self.belief
        return {
            "state": self.state.text,
            "words": self.words,
            "critical_speed": _known(belief.critical_speed),
            "critical_speed_deviation": _known(belief.critical_speed_deviation),
            "net_unbalance": _known(abs(belief.net_unbalance)),
            "net_unbalance_deviation": _known(belief.net_unbalance_deviation),
            "net_unbalance_before": _known(belief.without_balls),
            "dwells": belief.dwells,
            "retries": belief.retries,
        }


def net_unbalance(trajectory: Trajectory, scene: Scene) -> np.ndarray:
    """Return the offset of the rotor's centre of mass, balls included [m], shape (samples,).

    It is abs(M0 e + sum m_i R exp(i theta_i)) / M, which an adaptive start-up estimates.
    """
    moments = np.array(scene.balls.masses) * scene.race.radius
    own = scene.eccentric_mass * scene.rotor.eccentricity
    net: np.ndarray = np.abs(own + resultant(moments, trajectory.ball_angles)) / scene.total_mass
    return net


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None
