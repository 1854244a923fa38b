"""Outcome of an adaptive start-up: the controller's estimates and the true values."""

import math
from typing import NamedTuple

import numpy as np

from ab_sim.control import Estimates, State
from ab_sim.drive.adaptive_controller import AdaptiveController, EstimatesAt
from ab_sim.drive.balance import resultant
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene.model import Scene


class AdaptiveOutcome(NamedTuple):
    """Actions and estimates of a controller during a run."""

    state: State
    """State at the end."""
    words: str
    """Text for users: the controller's state at the end, and its reason."""
    estimates: Estimates
    """Estimates at the end."""
    history: tuple[EstimatesAt, ...]
    """Estimates at each command period, including the start."""

    @classmethod
    def of(cls, controller: AdaptiveController) -> "AdaptiveOutcome":
        """Return the outcome of a start-up so far."""
        start_up, history = controller.start_up, tuple(controller.history)
        return cls(start_up.state, start_up.words, start_up.estimates, history)

    def report(self) -> dict[str, object]:
        """Return the outcome as JSON-able values in SI units; None for unknown values."""
        estimates = self.estimates
        return {
            "state": self.state.text,
            "words": self.words,
            "critical_speed": _known(estimates.critical_speed),
            "critical_speed_deviation": _known(estimates.critical_speed_deviation),
            "net_unbalance": _known(abs(estimates.net_unbalance)),
            "net_unbalance_deviation": _known(estimates.net_unbalance_deviation),
            "net_unbalance_before": _known(estimates.without_balls),
            "dwells": estimates.dwells,
            "retries": estimates.retries,
        }


def net_unbalance(trajectory: Trajectory, scene: Scene) -> np.ndarray:
    """Return the offset of the rotor's centre of mass, balls included [m], shape (samples,).

    It is abs(M0 e + sum m_i R exp(i theta_i)) / M, which an adaptive start-up estimates.
    """
    moments = np.array(scene.balls.masses) * scene.race.radius
    rotor_unbalance = scene.eccentric_mass * scene.rotor.eccentricity
    net: np.ndarray = (
        np.abs(rotor_unbalance + resultant(moments, trajectory.ball_angles)) / scene.total_mass
    )
    return net


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None
