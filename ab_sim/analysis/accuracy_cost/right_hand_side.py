"""Equations of this package as f(t, y), for other packages' integrators.

This is the only module of the study that calls the equations. A scene's speed profile is cut into
legs at its breakpoints, so that f is smooth within each leg. Integrators restart at each leg.
"""

import copy
import math
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.accuracy_cost.energy import RunEnergies
from ab_sim.analysis.accuracy_cost.sampling import SampleTimes
from ab_sim.drive.accuracy.deviation import Samples
from ab_sim.drive.observation import EnergyBalance
from ab_sim.engine.integrate.vector_field import VectorField
from ab_sim.model.dynamics.assemble import place_on, start_discrete_state, start_state, system_of
from ab_sim.model.dynamics.layout import layout_of
from ab_sim.model.dynamics.system import TURNS, ActiveSegment, has_events
from ab_sim.model.spindle import SpeedSchedule
from ab_sim.scene.model import Scene

SAME_INSTANT = 1e-12
"""Difference up to which two times count as equal [s]."""


class SmoothInterval(NamedTuple):
    """Time interval in which f is smooth."""

    grid: np.ndarray
    """Times [s]: begin, sample times within, and end."""
    keep: np.ndarray
    """Indices of the sample times in ``grid``."""
    place: ActiveSegment
    start: float
    """Begin of the profile segment [s]: the origin of local time."""
    field: VectorField
    """Right-hand side f of y' = f(t, y) within the interval."""

    def f(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return the slope as a new array."""
        out = np.empty(len(y))
        self.fill(t, y, out)
        return out

    def fill(self, t: float, y: np.ndarray, out: np.ndarray) -> None:
        """Write the slope into ``out``; y may be a column of an array."""
        self.field.fill(t, np.ascontiguousarray(y), out)


class RightHandSide:
    """Scene without events as f(t, y), leg by leg.

    Args:
        scene: scene to simulate.
        sampling: sample times.
        energy_balance: whether to add the two states of the energy balance.
    """

    def __init__(self, scene: Scene, sampling: SampleTimes, energy_balance: bool = False) -> None:
        self.scene, self.sampling = scene, sampling
        self.system = system_of(scene, energy_balance)
        assert not has_events(self.system.effects), "f of a scene with events has kinks"
        self.start = start_state(scene, self.system)
        self.discrete_state = start_discrete_state(scene, self.system)
        self.profile = SpeedSchedule.of_scene(scene)
        self.legs = tuple(self._legs())

    def sampled(self, sampling: SampleTimes) -> "RightHandSide":
        """Return the same right-hand side with other sample times."""
        other = copy.copy(self)
        other.sampling = sampling
        other.legs = tuple(other._legs())
        return other

    @property
    def scale(self) -> np.ndarray:
        """Magnitudes of the states for absolute tolerances, shape (states,)."""
        layout, speed = layout_of(self.system), self.scene.spindle.max_speed
        length = self.scene.whirl_unit[0]
        energy = 0.5 * self.scene.total_mass * (length * speed) ** 2
        scale = np.empty(layout.size)
        scale[layout.deck] = self.system.deck_model.scale(length, speed)
        scale[layout.angles], scale[layout.rates], scale[layout.energy_balance] = 1.0, speed, energy
        return scale

    def samples(self, states: np.ndarray) -> Samples:
        """Convert states at the sample times, shape (samples, states), to samples."""
        layout, deck_model = layout_of(self.system), self.system.deck_model
        psi = self.profile.angles(np.asarray(self.sampling.times))
        position = deck_model.place(states[:, layout.deck], psi)
        turns = 2.0 * math.pi * self.discrete_state[: self.scene.balls.count, TURNS]
        return Samples(position, states[:, layout.angles] + turns)

    def energy_error(self, states: np.ndarray) -> float:
        """Return a run's error of the energy balance, from its states at the sample times."""
        before = self._stored(self.start, 0.0)
        return RunEnergies(
            [
                EnergyBalance(
                    self._stored(state, float(t)), before, float(state[-2]), float(state[-1])
                )
                for t, state in zip(self.sampling.times, states, strict=True)
            ]
        ).error()

    def _stored(self, state: np.ndarray, time: float) -> float:
        psi, speed = self.profile.angle(time), self.profile.speed(time)
        return self.system.mechanical_energy(state, psi, speed)

    def _legs(self) -> Any:
        times = self.sampling.times
        for scheduled in self.profile.segments:
            begin, end = scheduled.start, min(scheduled.end, self.sampling.end)
            if end - begin < SAME_INSTANT:
                continue
            inside = times[(times > begin + SAME_INSTANT) & (times < end - SAME_INSTANT)]
            last = np.abs(times - end).min() <= SAME_INSTANT
            yield SmoothInterval(
                np.concatenate([[begin], inside, [end]]),
                np.arange(1, len(inside) + 1 + last),
                place_on(scheduled),
                scheduled.start,
                VectorField(self.system, scheduled, self.discrete_state),
            )
