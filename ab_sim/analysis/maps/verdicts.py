"""What rests firmly at a point of a map: one whole number for each combination of kinds of states."""

from collections.abc import Iterable

import numpy as np

from ab_sim.analysis.equilibria import equilibria_of
from ab_sim.analysis.equilibria.states import RestingState
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

    Raises:
        SceneError: nothing rests in its equations.
    """
    return label_of(equilibria_of(scene, speed).branches)


def label_of(branches: Iterable[RestingState]) -> int:
    """The label of a speed's resting states, of which the worst and the best balanced one are."""
    label, balanced, states = NOTHING, set(), 0
    for state in branches:
        states += 1
        if state.stable is None:
            label |= UNDECIDED
        elif kind_of(state) == EVERYWHERE:
            balanced.add(state.stable)
        elif state.stable:
            label |= kind_of(state)
    if True in balanced:
        label |= SOMEWHERE if False in balanced else EVERYWHERE
    return label if states else NO_STATE


def kind_of(state: RestingState) -> int:
    """EVERYWHERE for any balanced one, CLUSTERED, SPLIT or PLAIN."""
    if len(state.theta) == 0 or state.label == "standing":
        return PLAIN
    if state.phase is None:
        return EVERYWHERE
    sides = np.cos(state.theta - state.phase) > 0.0
    return SPLIT if sides.any() and not sides.all() else CLUSTERED
