"""Labels of a map's points: one whole number for each combination of kinds of stable states."""

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from ab_sim.analysis.equilibria import equilibria_of
from ab_sim.analysis.equilibria.at_speed import (
    balanced_state,
    clustered_place,
    clustered_state,
)
from ab_sim.analysis.equilibria.extremes import positions_at
from ab_sim.analysis.equilibria.patterns import patterns_of, radii
from ab_sim.analysis.equilibria.resting import (
    ClosedFormRotor,
    field_at,
    resting_system,
    rotor_of,
    state_of,
)
from ab_sim.analysis.equilibria.states import RestingState
from ab_sim.dynamics.layout import StateLayout, layout_of
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
SPREAD = 64
"""W > 0, balls off the displacement's line, as where the race is off the shaft's axis: a deck that
comes as near to rest as it can is among them."""
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
    SPREAD: "spread",
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

    It equals ``label_of`` applied to ``equilibria_of``, and is several times as fast.

    Raises:
        SceneError: nothing rests in its equations.
    """
    system = resting_system(scene)
    rotor = rotor_of(system)
    if rotor is not None and speed != 0.0 and rotor.moments and rotor.unbalance:
        return _label(_verdicts(system, rotor, speed))
    found = equilibria_of(scene, speed)
    label = label_of(found.branches)
    # By numbers, the best of the balanced positions is all that is known.
    only_best = found.by_numbers and scene.balls.count > 2 and label > 0 and label & EVERYWHERE
    return label & ~EVERYWHERE | SOMEWHERE if only_best else label


def label_of(branches: Iterable[RestingState]) -> int:
    """The label of a speed's resting states, of which the worst and the best balanced one are."""
    return _label((kind_of(state), state.stable) for state in branches)


def kind_of(state: RestingState) -> int:
    """EVERYWHERE for any balanced one, CLUSTERED, SPLIT, SPREAD or PLAIN."""
    if len(state.theta) == 0 or state.label == "standing":
        return PLAIN
    if state.label.startswith("balanced"):
        return EVERYWHERE
    if state.label.startswith("spread"):
        return SPREAD
    sides = np.cos(state.theta - (state.phase or 0.0)) > 0.0
    return SPLIT if sides.any() and not sides.all() else CLUSTERED


def _label(verdicts: Iterable[tuple[int, bool | None]]) -> int:
    """Of states' kinds, and whether they are stable."""
    all_ = {*verdicts}
    if not all_:
        return NO_STATE
    label = UNDECIDED if None in {stable for _, stable in all_} else NOTHING
    for kind in (CLUSTERED, SPLIT, SPREAD, PLAIN):
        label |= kind if (kind, True) in all_ else NOTHING
    if (EVERYWHERE, True) in all_:
        others = {(EVERYWHERE, False), (EVERYWHERE, None)} & all_
        label |= SOMEWHERE if others else EVERYWHERE
    return label


class _UnjudgedState(NamedTuple):
    """A resting state whose stability was not computed yet."""

    kind: int
    zeros: int
    """Structural ones, of its eigenvalues."""
    u: np.ndarray
    theta: np.ndarray
    state: Callable[[], RestingState]
    """The same with all that there is to know, which takes longer."""


def _verdicts(
    system: System, rotor: ClosedFormRotor, speed: float
) -> Iterator[tuple[int, bool | None]]:
    """Kind, and what ``RestingState.stable`` says, of all states that closed forms give.

    Eigenvalues of all at once; those whose sign rounding could have changed are looked at again.
    """
    places = [*_clustered(system, rotor, speed), *_balanced(system, rotor, speed)]
    if not places:
        return
    field = field_at(system, speed)
    jacobians = np.array(
        [field.jacobian(0.0, state_of(system, speed, p.u, p.theta)) for p in places]
    )
    scale = _magnitudes(system, speed)
    doubts = NEAR * np.linalg.norm(jacobians * scale / scale[:, None], axis=(1, 2))
    for place, values, doubt in zip(places, np.linalg.eigvals(jacobians), doubts, strict=True):
        kept = np.argsort(np.abs(values))[place.zeros :]
        growth = float(values.real[kept].max())
        yield place.kind, growth < 0.0 if abs(growth) > doubt else place.state().stable


def _clustered(system: System, rotor: ClosedFormRotor, speed: float) -> Iterator[_UnjudgedState]:
    for pattern in patterns_of(rotor):
        kind = CLUSTERED if len({*pattern.signs}) == 1 else SPLIT
        roots = radii(rotor, pattern.moment, speed)
        for rank, W in enumerate(roots):
            place = clustered_place(rotor, speed, pattern, W)
            state = partial(clustered_state, system, rotor, speed, pattern, roots, rank)
            yield _UnjudgedState(kind, 0, *place, state)


def _balanced(system: System, rotor: ClosedFormRotor, speed: float) -> Iterator[_UnjudgedState]:
    zeros = max(0, len(rotor.moments) - 2)
    for theta in positions_at(system, rotor, speed):
        state = partial(balanced_state, system, rotor, speed, theta)
        yield _UnjudgedState(EVERYWHERE, zeros, np.zeros(2), theta, state)


def _magnitudes(system: System, speed: float) -> np.ndarray:
    """Scales of the state variables."""
    layout: StateLayout = layout_of(system)
    found = np.ones(layout.size)
    found[layout.deck] = system.deck_model.scale(float(system.balls[0, RACE_RADIUS]), abs(speed))
    found[layout.rates] = abs(speed)
    return found
