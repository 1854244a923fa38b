"""What is stable at a point of a map: a whole number for each combination of kinds of states."""

from collections.abc import Iterable

import numpy as np

from ab_sim.analysis.equilibria import equilibria_of
from ab_sim.analysis.equilibria.at_speed import balanced_state, clustered_states
from ab_sim.analysis.equilibria.balanced import positions
from ab_sim.analysis.equilibria.resting import (
    Rotor,
    field_at,
    resting_system,
    rotor_of,
    state_of,
)
from ab_sim.analysis.equilibria.states import RestingState
from ab_sim.dynamics.layout import Layout, layout_of
from ab_sim.dynamics.system import RACE_RADIUS, System
from ab_sim.scene.model import Scene

EVERYWHERE = 1
"""Balanced, wherever the balls sit on the balanced set."""
SOMEWHERE = 2
"""Balanced at some positions of three and more balls, and not at others."""
CLUSTERED = 4
"""W > 0, all balls on one side of the shaft."""
SPLIT = 8
"""W > 0, some on the side of the displacement, some opposite."""
PLAIN = 16
"""W > 0 without balls; or the spindle stands still."""
UNDECIDED = 32
"""The linear test decides nothing about some state."""
NOTHING = 0
"""No state is stable."""
NO_STATE = -1
"""There is none that could be."""

NEAR = 1e-6
"""Growth rates this small, as a share of the Jacobian's norm, may have the wrong sign: more than
``RestingState.doubt`` ever is."""

BALANCED = EVERYWHERE | SOMEWHERE
NAMES = {
    EVERYWHERE: "balanced",
    SOMEWHERE: "balanced at some positions",
    CLUSTERED: "clustered",
    SPLIT: "split",
    PLAIN: "at rest without balls",
    UNDECIDED: "undecided",
}


def name_of(label: int) -> str:
    """A label in words."""
    if label == NO_STATE:
        return "no resting state"
    found = [name for bit, name in NAMES.items() if label & bit]
    return " + ".join(found) or "nothing stable"


def verdict(scene: Scene, speed: float) -> int:
    """The label of a scene at a speed [rad/s].

    What ``label_of`` says of ``equilibria_of``, five times as fast for three and more balls.

    Raises:
        SceneError: nothing rests in its equations.
    """
    system = resting_system(scene)
    rotor = rotor_of(system)
    if rotor is None or speed == 0.0 or len(rotor.moments) < 3:
        found = equilibria_of(scene, speed)
        label = label_of(found.branches)
        # By numbers, the best of the balanced positions is all that is known.
        only_best = found.by_numbers and len(scene.balls.masses) > 2 and label > 0
        return label & ~EVERYWHERE | SOMEWHERE if only_best and label & EVERYWHERE else label
    states = clustered_states(system, rotor, speed)
    verdicts = _balanced(system, rotor, speed)
    return _label(len(states) + len(verdicts), states, verdicts)


def label_of(branches: Iterable[RestingState]) -> int:
    """The label of a speed's resting states, of which the worst and the best balanced one are."""
    states = list(branches)
    balanced = {state.stable for state in states if kind_of(state) == EVERYWHERE}
    return _label(len(states), [s for s in states if kind_of(s) != EVERYWHERE], balanced)


def kind_of(state: RestingState) -> int:
    """EVERYWHERE for any balanced one, CLUSTERED, SPLIT or PLAIN."""
    if len(state.theta) == 0 or state.label == "standing":
        return PLAIN
    if state.label.startswith("balanced"):
        return EVERYWHERE
    sides = np.cos(state.theta - (state.phase or 0.0)) > 0.0
    return SPLIT if sides.any() and not sides.all() else CLUSTERED


def _label(states: int, unbalanced: Iterable[RestingState], balanced: set[bool | None]) -> int:
    label = UNDECIDED if None in balanced else NOTHING
    for state in unbalanced:
        if state.stable is None:
            label |= UNDECIDED
        elif state.stable:
            label |= kind_of(state)
    if True in balanced:
        label |= SOMEWHERE if False in balanced else EVERYWHERE
    return label if states else NO_STATE


def _balanced(system: System, rotor: Rotor, speed: float) -> set[bool | None]:
    """What ``RestingState.stable`` says of all balanced positions that are looked at.

    Eigenvalues of all at once; those whose sign rounding could have changed are looked at again.
    """
    places = positions(rotor)
    if len(places) == 0:
        return set()
    first = balanced_state(system, rotor, speed, places[0])
    found = {first.stable}
    field = field_at(system, speed)
    here = (state_of(system, speed, np.zeros(2), theta) for theta in places[1:])
    jacobians = np.array([field.jacobian(0.0, state) for state in here])
    if len(jacobians) == 0:
        return found
    values = np.linalg.eigvals(jacobians)
    order = np.argsort(np.abs(values), axis=1)[:, first.structural_zeros :]
    growth = np.take_along_axis(values, order, axis=1).real.max(axis=1)
    scale = _magnitudes(system, speed)
    near = np.abs(growth) <= NEAR * np.linalg.norm(jacobians * scale / scale[:, None], axis=(1, 2))
    found.update((growth[~near] < 0.0).tolist())
    found.update(balanced_state(system, rotor, speed, x).stable for x in places[1:][near])
    return found


def _magnitudes(system: System, speed: float) -> np.ndarray:
    """Of the states, for numbers in them to be compared with each other."""
    layout: Layout = layout_of(system)
    found = np.ones(layout.size)
    found[layout.carrier] = system.carrier.scale(float(system.balls[0, RACE_RADIUS]), abs(speed))
    found[layout.rates] = abs(speed)
    return found
