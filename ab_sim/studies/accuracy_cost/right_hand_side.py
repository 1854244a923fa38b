"""The package's equations as f(t, y), for integrators that are not the package's.

The only module here that knows how the equations are called. A scene's speed profile is cut
into legs at its breakpoints, so that f is smooth within each; integrators start anew at each.
"""

import copy
import math
from typing import Any, NamedTuple

import numpy as np

from ab_sim.accuracy.deviation import Samples
from ab_sim.drive.observation import Energy
from ab_sim.dynamics.assemble import place_on, start_modes, start_state, system_of
from ab_sim.dynamics.energy import mechanical_energy
from ab_sim.dynamics.layout import layout_of
from ab_sim.dynamics.system import TURNS, Place, has_events
from ab_sim.integrate.vector_field import VectorField
from ab_sim.scene.model import Scene
from ab_sim.spindle import SpeedProfile
from ab_sim.studies.accuracy_cost.energy import EnergyBalance
from ab_sim.studies.accuracy_cost.sampling import Sampling

SAME_INSTANT = 1e-12
"""s."""


class Leg(NamedTuple):
    """A stretch of time in which f is smooth."""

    grid: np.ndarray
    """Times [s]: its begin, the sample times within, its end."""
    keep: np.ndarray
    """Which of them are sample times, as indices."""
    place: Place
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
        ledger: also the two states of the ledger.
    """

    def __init__(self, scene: Scene, sampling: Sampling, ledger: bool = False) -> None:
        self.scene, self.sampling = scene, sampling
        self.system = system_of(scene, ledger)
        assert not has_events(self.system.effects), "f of a scene with events has kinks"
        self.start = start_state(scene, self.system)
        self.modes = start_modes(scene, self.system)
        self.profile = SpeedProfile.of_scene(scene)
        self.legs = tuple(self._legs())

    def sampled(self, sampling: Sampling) -> "RightHandSide":
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
        scale[layout.carrier] = self.system.carrier.scale(length, speed)
        scale[layout.angles], scale[layout.rates], scale[layout.ledger] = 1.0, speed, energy
        return scale

    def samples(self, states: np.ndarray) -> Samples:
        """States at the sample times, shape (samples, states), as samples."""
        layout, carrier = layout_of(self.system), self.system.carrier
        psi = np.array([self.profile.angle(float(t)) for t in self.sampling.times])
        position = carrier.place(states[:, layout.carrier], psi)
        turns = 2.0 * math.pi * self.modes[: self.scene.balls.count, TURNS]
        return Samples(position, states[:, layout.angles] + turns)

    def energy_error(self, states: np.ndarray) -> float:
        """Of a run with a ledger, from its states at the sample times."""
        before = self._stored(self.start, 0.0)
        return EnergyBalance(
            [
                Energy(self._stored(state, float(t)), before, float(state[-2]), float(state[-1]))
                for t, state in zip(self.sampling.times, states, strict=True)
            ]
        ).error()

    def _stored(self, state: np.ndarray, time: float) -> float:
        psi, speed = self.profile.angle(time), self.profile.speed(time)
        return mechanical_energy(self.system, state, psi, speed)

    def _legs(self) -> Any:
        times = self.sampling.times
        for piece in self.profile.pieces:
            begin, end = piece.start, min(piece.end, self.sampling.end)
            if end - begin < SAME_INSTANT:
                continue
            inside = times[(times > begin + SAME_INSTANT) & (times < end - SAME_INSTANT)]
            last = np.abs(times - end).min() <= SAME_INSTANT
            yield Leg(
                np.concatenate([[begin], inside, [end]]),
                np.arange(1, len(inside) + 1 + last),
                place_on(piece),
                piece.start,
                VectorField(self.system, piece, self.modes),
            )
