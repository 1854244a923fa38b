"""The package's equations as f(t, y), for integrators that are not the package's.

The only module here that knows how the equations are called. A scene's speed profile is cut
into legs at its breakpoints, so that f is smooth within each; integrators start anew at each.
"""

import copy
import math
from typing import Any, NamedTuple

import numpy as np

from ab_sim.accuracy.deviation import Samples
from ab_sim.drive.observation import EnergyBalance
from ab_sim.dynamics.assemble import place_on, start_discrete_state, start_state, system_of
from ab_sim.dynamics.layout import layout_of
from ab_sim.dynamics.system import TURNS, ActiveSegment, has_events
from ab_sim.integrate.vector_field import VectorField
from ab_sim.scene.model import Scene
from ab_sim.spindle import SpeedSchedule
from ab_sim.studies.accuracy_cost.energy import RunEnergies
from ab_sim.studies.accuracy_cost.sampling import SampleTimes

SAME_INSTANT = 1e-12
"""s."""


class SmoothInterval(NamedTuple):
    """A stretch of time in which f is smooth."""

    grid: np.ndarray
    """Times [s]: its begin, the sample times within, its end."""
    keep: np.ndarray
    """Which of them are sample times, as indices."""
    place: ActiveSegment
    start: float
    """When the segment begins [s]: local time is counted from it."""
    field: VectorField
    """The equations there."""

    def f(self, t: float, y: np.ndarray) -> np.ndarray:
        """The slope, a new array."""
        out = np.empty(len(y))
        self.fill(t, y, out)
        return out

    def fill(self, t: float, y: np.ndarray, out: np.ndarray) -> None:
        """The slope into ``out``; y may be a column of an array."""
        self.field.fill(t, np.ascontiguousarray(y), out)


class RightHandSide:
    """A scene without events as f(t, y), leg by leg.

    Args:
        scene: what to simulate.
        sampling: when samples are kept.
        energy_balance: also the two states of the energy balance.
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
        """The same at other sample times."""
        other = copy.copy(self)
        other.sampling = sampling
        other.legs = tuple(other._legs())
        return other

    @property
    def scale(self) -> np.ndarray:
        """Magnitudes from which absolute tolerances are made, shape (states,)."""
        layout, speed = layout_of(self.system), self.scene.spindle.max_speed
        length = self.scene.whirl_unit[0]
        energy = 0.5 * self.scene.total_mass * (length * speed) ** 2
        scale = np.empty(layout.size)
        scale[layout.deck] = self.system.deck_model.scale(length, speed)
        scale[layout.angles], scale[layout.rates], scale[layout.energy_balance] = 1.0, speed, energy
        return scale

    def samples(self, states: np.ndarray) -> Samples:
        """States at the sample times, shape (samples, states), as samples."""
        layout, deck_model = layout_of(self.system), self.system.deck_model
        psi = self.profile.angles(np.asarray(self.sampling.times))
        position = deck_model.place(states[:, layout.deck], psi)
        turns = 2.0 * math.pi * self.discrete_state[: self.scene.balls.count, TURNS]
        return Samples(position, states[:, layout.angles] + turns)

    def energy_error(self, states: np.ndarray) -> float:
        """Of a run with an energy balance, from its states at the sample times."""
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
