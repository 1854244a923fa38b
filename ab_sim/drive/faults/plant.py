"""Effects of faults on the equations of motion: a system of the same kind with other constants.

The compiled kernel is therefore reused, at the same cost as without faults.

A held ball has no mobility. The equations of the carrier of the balls are written with all balls
held on the race, and moving balls are then taken out (docs/equations.md, 2); a held ball stays in.
Its mass is kept and so becomes a part of the rotor's unbalance and inertia. A lost ball is a held
ball without mass.
"""

import functools
from collections.abc import Callable, Iterable

import numpy as np

from ab_sim.drive.faults.fault import OF_BALLS, Fault
from ab_sim.model.dynamics.system import (
    DIRECTION,
    LEVER,
    MASS,
    MOBILITY,
    MOMENT,
    RACE_RADIUS,
    ROLLING_MASS,
    System,
    has_friction,
    has_motor,
    layout_of,
)
from ab_sim.model.equations.mounts import DAMPING, STIFFNESS
from ab_sim.scene.model import Scene

_BEYOND_ALL = 1e100
"""Rolling mass [kg] of a ball that cannot move, for code that uses the inertia, not the
mobility."""


def faulty_system(sound: System, scene: Scene, faults: Iterable[Fault]) -> System:
    """Return the system with faults; faults of the disc and of sensors do not change it.

    The deck's displacement still counts from its rest position without the faults.
    """
    system, balls = sound, sound.balls.copy()
    missing = 0.0
    for fault in faults:
        if fault.verb in OF_BALLS:
            ball = _ball_number(fault)
            balls[ball, [ROLLING_MASS, MOBILITY]] = _BEYOND_ALL, 0.0
            if fault.verb == "lost":
                missing += float(balls[ball, MASS])
                balls[ball, [MASS, MOMENT, LEVER]] = 0.0
        elif fault.verb == "softens":
            assert fault.size is not None
            system = _softened(system, scene, fault.component, fault.size)
    if missing:
        # Built-in deck models have this field; with others, no ball can be lost
        # (``fault.check_faults``).
        lighter = system.deck_model._replace(total_mass=system.deck_model.total_mass - missing)
        system = system._replace(deck_model=lighter)
    return system._replace(balls=balls)


def _ball_number(fault: Fault) -> int:
    """Return the number of a fault's ball."""
    return int(fault.component.rpartition("_")[2])


def held_balls(faults: Iterable[Fault]) -> list[int]:
    """Return the numbers of balls that do not move along the race: stuck or lost ones."""
    return sorted(_ball_number(fault) for fault in faults if fault.verb in OF_BALLS)


def stop_held_balls(
    system: System,
    state: np.ndarray,
    discrete_state: np.ndarray,
    held: Iterable[int],
    psi: float,
) -> None:
    """Bring held balls to rest on the race, by a shock between each ball and the race.

    The velocities q' of all other coordinates jump so that their momenta are conserved: with the
    mass matrix G, G_ff dq'_f = -G_fh dq'_h; G follows from the energy. The motor keeps a prescribed
    spindle speed.

    Parameters
    ----------
    system
        System with the faults.
    state
        State of the system, modified in place.
    discrete_state
        Discrete state with the balls' sliding directions, modified in place.
    held
        Numbers of the held balls.
    psi
        Spindle angle [rad].
    """
    layout, n = layout_of(system), len(system.balls)
    stopped = layout.rates.start + np.array(list(held), int)
    if not state[stopped].any():
        return
    unknowns = int(type(system.deck_model).UNKNOWNS)
    bearing = [layout.deck.stop - unknowns + k for k in range(unknowns)]
    if has_motor(system.effects):
        bearing.append(layout.spindle.start + 1)
    balls = [layout.rates.start + i for i in range(n) if system.balls[i, MOBILITY] > 0.0]
    inertia = _mass_matrix(system, state, psi, bearing, [*balls, *stopped.tolist()])
    free = [*bearing, *balls]
    f, leap = len(free), -state[stopped]
    state[free] += np.linalg.solve(inertia[:f, :f], -inertia[:f, f:] @ leap)
    state[stopped] = 0.0
    if has_friction(system.effects):
        discrete_state[:n, DIRECTION] = np.sign(state[layout.rates])


def _softened(system: System, scene: Scene, component: str, part: float) -> System:
    """Return the system with ``part`` of the stiffness of a mount or of a suspension effect."""
    kind, _, which = component.rpartition("_")
    if kind == "mount":
        mounts = system.deck_model.mounts.copy()
        mounts[int(which), STIFFNESS:DAMPING] *= part
        return system._replace(deck_model=system.deck_model._replace(mounts=mounts))
    at = list(scene.effects).index(component)
    effect = system.effects[at]
    weaker = {key: part * getattr(effect, key) for key in effect._fields if "stiffness" in key}
    effects = (*system.effects[:at], effect._replace(**weaker), *system.effects[at + 1 :])
    return system._replace(effects=effects)


def _mass_matrix(
    system: System, state: np.ndarray, psi: float, bearing: list[int], balls: list[int]
) -> np.ndarray:
    """Return the mass matrix G of carrier and balls; entries of two different balls are 0."""
    every, k = _inertias(system, state, psi), len(bearing)
    layout = layout_of(system)
    matrix = np.zeros((k + len(balls),) * 2)
    for row, one in enumerate(bearing):
        for column, other in enumerate(bearing[: row + 1]):
            matrix[row, column] = matrix[column, row] = every(one, other)
    for at, rate in enumerate(balls, start=k):
        # The energy of the other balls does not depend on this ball.
        alone, its_state = _with_one_ball(system, state, rate - layout.rates.start)
        shared, its = _inertias(alone, its_state, psi), layout_of(alone)
        its_rate = its.rates.start
        matrix[at, at] = shared(its_rate, its_rate)
        for row, one in enumerate(bearing):
            # A motor's states come after those of all balls.
            there = one if one < layout.deck.stop else one - layout.size + its.size
            matrix[row, at] = matrix[at, row] = shared(there, its_rate)
    return matrix


def _with_one_ball(system: System, state: np.ndarray, ball: int) -> tuple[System, np.ndarray]:
    """Return system and state with all balls left out except one."""
    layout = layout_of(system)
    one = system._replace(balls=system.balls[[ball]], contacts=np.empty((0, 2)))
    ball_state = state[layout.angles.start + ball], state[layout.rates.start + ball]
    return one, np.concatenate([state[layout.deck], ball_state, state[layout.spindle]])


def _inertias(system: System, state: np.ndarray, psi: float) -> Callable[[int, int], float]:
    """Return a function for entries of G by state index, from second differences of the energy.

    The energy is quadratic in the velocities, so the differences are exact.
    """
    layout, driven = layout_of(system), has_motor(system.effects)
    at_rest = state.copy()
    unknowns = int(type(system.deck_model).UNKNOWNS)
    at_rest[layout.deck.stop - unknowns : layout.deck.stop] = 0.0
    at_rest[layout.rates] = 0.0
    if driven:
        at_rest[layout.spindle][1] = 0.0
    radius = float(system.balls[0, RACE_RADIUS])

    def size(at: int) -> float:
        # Speeds of about 1 m/s each, so that rounding of one energy does not hide another.
        return 1.0 / radius if layout.rates.start <= at < layout.rates.stop else 1.0

    @functools.cache
    def energy(*moving: int) -> float:
        there = at_rest.copy()
        for at in moving:
            there[at] += size(at)
        speed = float(there[layout.spindle][1]) if driven else 0.0
        return system.mechanical_energy(there, psi, speed)

    def shared(one: int, other: int) -> float:
        inertias = energy(one, other) - energy(one) - energy(other) + energy()
        return inertias / (size(one) * size(other))

    return shared
