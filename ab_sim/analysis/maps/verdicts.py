"""Labels of a map's points: one integer per combination of kinds of stable states."""

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
from ab_sim.model.dynamics.layout import StateLayout, layout_of
from ab_sim.model.dynamics.system import RACE_RADIUS, System
from ab_sim.scene.model import Scene

EVERYWHERE = 1
"""Bit of balance that is stable at all positions of the balanced set."""
SOMEWHERE = 2
"""Bit of balance that is stable at some, but not all, positions of three or more balls."""
CLUSTERED = 4
"""Bit of a stable state with W > 0 and all balls on one side of the shaft."""
SPLIT = 8
"""Bit of a stable state with W > 0 and balls on both sides of the displacement."""
PLAIN = 16
"""Bit of a stable state without balls, or at zero speed."""
UNDECIDED = 32
"""Bit of a state for which the linear test is undecided."""
SPREAD = 64
"""Bit of a stable state with W > 0 and balls off the line of the displacement.

It occurs, for example, with a race off the shaft's axis, and includes the state of least possible
whirl.
"""
NOTHING = 0
"""Label of a point without a stable state."""
NO_STATE = -1
"""Label of a point without a resting state."""

NEAR = 1e-6
"""Growth rate, relative to the Jacobian's norm, below which the sign may be wrong.

It is larger than any ``RestingState.doubt``.
"""

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
    """Return a label in words."""
    if label == NO_STATE:
        return "no resting state"
    names = [name for bit, name in NAMES.items() if label & bit]
    return " + ".join(names) or "nothing stable"


def verdict(scene: Scene, speed: float) -> int:
    """Return the label of a scene at a speed [rad/s].

    It equals ``label_of`` applied to ``equilibria_of``, and is several times as fast.

    Raises:
        SceneError: the scene's equations have no resting states.
    """
    system = resting_system(scene)
    rotor = rotor_of(system)
    if rotor is not None and speed != 0.0 and rotor.moments and rotor.unbalance:
        return _label(_verdicts(system, rotor, speed))
    equilibria = equilibria_of(scene, speed)
    label = label_of(equilibria.branches)
    # The numerical search does not cover all balanced positions, so stability at all of them cannot
    # be claimed.
    only_best = equilibria.by_numbers and scene.balls.count > 2 and label > 0 and label & EVERYWHERE
    return label & ~EVERYWHERE | SOMEWHERE if only_best else label


def label_of(branches: Iterable[RestingState]) -> int:
    """Return the label of resting states, including the worst and best balanced one."""
    return _label((kind_of(state), state.stable) for state in branches)


def kind_of(state: RestingState) -> int:
    """Return EVERYWHERE for a balanced state, else CLUSTERED, SPLIT, SPREAD or PLAIN."""
    if len(state.theta) == 0 or state.label == "standing":
        return PLAIN
    if state.label.startswith("balanced"):
        return EVERYWHERE
    if state.label.startswith("spread"):
        return SPREAD
    sides = np.cos(state.theta - (state.phase or 0.0)) > 0.0
    return SPLIT if sides.any() and not sides.all() else CLUSTERED


def _label(verdicts: Iterable[tuple[int, bool | None]]) -> int:
    """Return the label of states, given by kind and stability."""
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
    """Resting state whose stability has not been computed yet."""

    kind: int
    zeros: int
    """Number of structural zeros among its eigenvalues."""
    u: np.ndarray
    theta: np.ndarray
    state: Callable[[], RestingState]
    """Function that returns the complete state, which takes longer."""


def _verdicts(
    system: System, rotor: ClosedFormRotor, speed: float
) -> Iterator[tuple[int, bool | None]]:
    """Yield kind and stability, as ``RestingState.stable``, of all states in closed form.

    The eigenvalues of all states are computed together. States whose sign may be wrong due to
    rounding are computed again with error bounds.
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
    """Return the scales of the state variables."""
    layout: StateLayout = layout_of(system)
    magnitudes = np.ones(layout.size)
    magnitudes[layout.deck] = system.deck_model.scale(
        float(system.balls[0, RACE_RADIUS]), abs(speed)
    )
    magnitudes[layout.rates] = abs(speed)
    return magnitudes
