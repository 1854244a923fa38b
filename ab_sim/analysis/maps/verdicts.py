"""Labels of a map's points: one integer per combination of kinds of stable states.

A second label tells whether all balls can circulate in one bunch, by the closed form.
"""

import math
from collections.abc import Iterable, Iterator

import numpy as np

from ab_sim.analysis.circulating import drive_of, stalled
from ab_sim.analysis.equilibria import equilibria_of
from ab_sim.analysis.equilibria.at_speed import (
    RestingPlace,
    balanced_place,
    clustered_places,
)
from ab_sim.analysis.equilibria.balanced import positions_at
from ab_sim.analysis.equilibria.patterns import patterns_of
from ab_sim.analysis.equilibria.resting import (
    ClosedFormRotor,
    field_at,
    resting_system,
    rotor_of,
    state_of,
)
from ab_sim.analysis.equilibria.states import RestingState, resting_state
from ab_sim.analysis.held_speed import state_scale
from ab_sim.analysis.maps.plane import Plane
from ab_sim.analysis.maps.refine import Point
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
"""Bits of stable balance."""
NAMES = {
    EVERYWHERE: "balanced",
    SOMEWHERE: "balanced at some positions",
    CLUSTERED: "clustered",
    SPLIT: "split",
    PLAIN: "at rest without balls",
    SPREAD: "spread",
    UNDECIDED: "undecided",
}
"""Words for the bits of a label, in the order in which ``name_of`` joins them."""


def name_of(label: int) -> str:
    """Return a label in words: the names of its bits, joined by a plus sign."""
    if label == NO_STATE:
        return "no resting state"
    names = [name for bit, name in NAMES.items() if label & bit]
    return " + ".join(names) or "nothing stable"


def verdict(scene: Scene, speed: float) -> int:
    """Return the label of a scene at a speed [rad/s].

    It equals ``label_of`` applied to ``equilibria_of``, and is several times as fast.

    Raises
    ------
    SceneError
        The scene's equations have no resting states.
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
    """Return a point's label from its resting states; of balanced ones, from the best and worst."""
    return _label((kind_of(state), state.stable) for state in branches)


def kind_of(state: RestingState | RestingPlace) -> int:
    """Return the bit of a state: EVERYWHERE if balanced, else CLUSTERED, SPLIT, SPREAD or PLAIN."""
    if len(state.theta) == 0 or state.label == "standing":
        return PLAIN
    if state.label.startswith("balanced"):
        return EVERYWHERE
    if state.label.startswith("spread"):
        return SPREAD
    sides = np.cos(state.theta - math.atan2(state.u[1], state.u[0])) > 0.0
    return SPLIT if sides.any() and not sides.all() else CLUSTERED


def _label(verdicts: Iterable[tuple[int, bool | None]]) -> int:
    """Return a point's label from the kind and the stability of each resting state."""
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


def _verdicts(
    system: System, rotor: ClosedFormRotor, speed: float
) -> Iterator[tuple[int, bool | None]]:
    """Yield the kind and the stability (``RestingState.stable``) of all states in closed form.

    The eigenvalues of all states are computed together. States whose sign may be wrong due to
    rounding are computed again with error bounds.

    Parameters
    ----------
    system
        Result of ``resting_system``.
    rotor
        Closed-form parameters of the system.
    speed
        Spindle speed w [rad/s], not 0.
    """
    places = [p for pattern in patterns_of(rotor) for p in clustered_places(rotor, speed, pattern)]
    places += [balanced_place(rotor, theta) for theta in positions_at(system, rotor, speed)]
    if not places:
        return
    field = field_at(system, speed)
    jacobians = np.array(
        [field.jacobian(0.0, state_of(system, speed, p.u, p.theta)) for p in places]
    )
    scale = state_scale(system, float(system.balls[0, RACE_RADIUS]), speed)
    doubts = NEAR * np.linalg.norm(jacobians * scale / scale[:, None], axis=(1, 2))
    for place, values, doubt in zip(places, np.linalg.eigvals(jacobians), doubts, strict=True):
        kept = np.argsort(np.abs(values))[place.structural_zeros :]
        growth = float(values.real[kept].max())
        decided = abs(growth) > doubt
        stable = growth < 0.0 if decided else resting_state(system, speed, *place).stable
        yield kind_of(place), stable


NOT_COVERED = -1
"""Code of a scene outside the closed form: see ``circulating.reason_not_covered``."""
NONE_CIRCULATES = 0
"""Code of a point at which no stable bunch of all balls exists."""
CIRCULATES = 1
"""Code of a point at which all balls can circulate in a stable bunch."""
NOT_KNOWN = 2
"""Code of a point with a bunch whose swings are too large for the closed form."""
CIRCULATION_NAMES = {
    CIRCULATES: "balls can also circulate",
    NOT_KNOWN: "whether they can is not known",
}
"""Words for the codes of circulating balls, for the legend of maps."""


def circulation_at(plane: Plane, point: Point) -> int:
    """Return the code of circulation at a point (row, column)."""
    scene, speed = plane.at(*point)
    drive = drive_of(scene)
    if drive is None:
        return NOT_COVERED
    if stalled(drive, speed, drive.balls) is not None:
        return CIRCULATES
    # A bunch outside the closed form's validity may exist: report it neither as yes nor as no.
    plausible = stalled(drive, speed, drive.balls, valid_only=False)
    return NONE_CIRCULATES if plausible is None else NOT_KNOWN
