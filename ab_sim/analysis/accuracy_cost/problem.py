"""Problem that all methods solve: sample times, right-hand side, and error of the energy balance.

Only this module of the study calls the equations of the package as f(t, y), for other packages'
integrators. A scene's speed profile is cut into legs at its breakpoints, so that f is smooth within
each leg. Integrators restart at each leg.
"""

import copy
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ab_sim.analysis.held_speed import state_scale
from ab_sim.base.errors import InputError, SceneError
from ab_sim.drive import Drive
from ab_sim.drive.accuracy.trials import MOST_SAMPLES, Samples
from ab_sim.drive.observation import EnergyBalance
from ab_sim.engine.integrate.vector_field import VectorField
from ab_sim.model.dynamics.assemble import start_discrete_state, start_state, system_of
from ab_sim.model.dynamics.system import TURNS, has_events, layout_of
from ab_sim.model.spindle import ScheduledSegment, SpeedSchedule
from ab_sim.scene.model import Scene

LADDER = (0.1e-3, 0.2e-3, 0.5e-3, 1e-3, 2e-3, 2.5e-3, 5e-3, 10e-3)
"""Steps at which every stepper is measured [s]; all divide the longest."""
LEAST_SAMPLES = 20
"""Least number of sample periods in a scene."""
_DENSE = 0.5e-3
"""Shortest step [s] for which runs are compared at the end of every step. Just after a jump of the
spindle's acceleration, errors of long steps peak for some milliseconds."""


class SampleTimes(NamedTuple):
    """Sample times at whole multiples of a period, at which steps of all runs end."""

    period: float
    """Time between two sample times [s]."""
    number: int
    """Number of sample times."""
    parts: int = 1
    """Number of reference samples per period; runs are compared at those where a step ends."""

    @property
    def times(self) -> np.ndarray:
        """Times [s], shape (number,), without the start, where all runs agree."""
        return np.arange(1, self.number + 1) * self.period

    @property
    def end(self) -> float:
        """Last sample time [s]."""
        return self.number * self.period

    @property
    def finest(self) -> "SampleTimes":
        """Sample times of the reference, ``parts`` in each period."""
        return SampleTimes(self.period / self.parts, self.number * self.parts)

    def per_period(self, step: float) -> int:
        """Return the number of steps [s] per period; 0 if it is not whole."""
        period, length = nanoseconds(self.period), nanoseconds(step)
        return period // length if period % length == 0 else 0


def sampling_of(scene: Scene) -> SampleTimes:
    """Return the common sample times of a scene.

    The period is the smallest multiple of the ladder's longest step that the scene's step divides,
    or that longest step itself if too few samples would remain. A short scene uses a shorter step
    of the ladder. All steps down to ``_DENSE``, of the ladder and of the scene, end at one of the
    period's parts, unless that needs too many parts. If the duration is not a multiple of the
    period, the comparison ends at the last whole period.

    Raises
    ------
    InputError
        The duration is too short to compare anything.
    """
    duration = nanoseconds(scene.duration)
    longest, scene_step = nanoseconds(LADDER[-1]), nanoseconds(scene.solver.step)
    candidates = [math.lcm(longest, scene_step)] + [nanoseconds(step) for step in reversed(LADDER)]
    for period in candidates:
        if duration // period >= LEAST_SAMPLES:
            times = SampleTimes(period / 1e9, duration // period)
            return times._replace(parts=_parts(times, [scene.solver.step, *reversed(LADDER)]))
    least = LEAST_SAMPLES * LADDER[0]
    raise InputError(
        f"duration = {scene.duration:g} s: too short to compare steppers in; give at least "
        f"{least:g} s, e.g. --set duration={least:g}"
    )


def _parts(sampling: SampleTimes, steps: list[float]) -> int:
    """Return the number of reference samples per period at which steps [s] end, see above."""
    parts = 1
    for step in steps:
        per_period = sampling.per_period(step)
        if (
            per_period
            and step >= _DENSE
            and sampling.number * math.lcm(parts, per_period) <= MOST_SAMPLES
        ):
            parts = math.lcm(parts, per_period)
    return parts


def nanoseconds(time: float) -> int:
    """Return the nearest whole number of nanoseconds, for exact comparison of steps."""
    return round(time * 1e9)


INSTANTS = 200
"""Approximate number of instants per run at which energies are evaluated, in slow Python."""


def energy_error(energies: list[EnergyBalance]) -> float:
    """Return the relative error of the energy balance over a run.

    It is the largest |stored - at start - motor work + dissipated|, divided by the largest stored,
    supplied or dissipated energy since the start.

    Parameters
    ----------
    energies
        Energy balances at some instants of the run.
    """
    stored, start, work, dissipated = np.array(energies).T
    size = max(float(np.abs(column).max()) for column in (stored - start, work, dissipated))
    gap = float(np.abs(stored - start - work + dissipated).max())
    return gap / size if size > 0.0 else 0.0


def energy_balance_refusal(scene: Scene) -> str:
    """Return the reason why a scene has no energy balance; empty if it has one."""
    try:
        Drive(scene, energy_balance=True)
    except SceneError as error:
        return str(error)
    return ""


SAME_INSTANT = 1e-12
"""Difference up to which two times count as equal [s]."""


class SmoothInterval(NamedTuple):
    """Time interval in which f is smooth."""

    grid: np.ndarray
    """Times [s]: begin, sample times within, and end."""
    keep: np.ndarray
    """Indices of the sample times in ``grid``."""
    field: VectorField
    """Right-hand side f of y' = f(t, y) within the interval."""

    @property
    def scheduled(self) -> ScheduledSegment:
        """Segment of the schedule that contains the interval; its start is that of local time."""
        return self.field.scheduled

    def f(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return the slope at time t [s] and state y as a new array, shape (states,)."""
        out = np.empty(len(y))
        self.fill(t, y, out)
        return out

    def fill(self, t: float, y: np.ndarray, out: np.ndarray) -> None:
        """Write the slope at time t [s] and state y into ``out``; y need not be contiguous."""
        self.field.fill(t, np.ascontiguousarray(y), out)


class RightHandSide:
    """Scene without events as f(t, y), leg by leg.

    Parameters
    ----------
    scene
        Scene to simulate.
    sampling
        Sample times.
    energy_balance
        Whether to add the two states of the energy balance.
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
        """Return a copy of this right-hand side with other sample times."""
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
        scale = state_scale(self.system, length, speed)
        scale[layout.energy_balance] = energy
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
        return energy_error(
            [
                EnergyBalance(
                    self._stored(state, float(t)), before, float(state[-2]), float(state[-1])
                )
                for t, state in zip(self.sampling.times, states, strict=True)
            ]
        )

    def _stored(self, state: np.ndarray, time: float) -> float:
        """Return the mechanical energy of a state at a time [J]."""
        psi, speed = self.profile.angle(time), self.profile.speed(time)
        return self.system.mechanical_energy(state, psi, speed)

    def _legs(self) -> Iterator[SmoothInterval]:
        """Yield the smooth intervals up to the last sample time, one per profile segment."""
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
                VectorField(self.system, scheduled, self.discrete_state),
            )
