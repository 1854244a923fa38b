"""Replacement of the disc of a drive: an unbalance of another size and direction.

Rotating axis 1 points at the unbalance, and ball angles count from it. If the new unbalance lies
ahead of the old one by an angle, only that axis turns and nothing moves: ball angles decrease by
the angle, and the spindle's angle, which is that of the axis in the inertial frame, increases.
"""

import math
from collections.abc import Callable

import numpy as np

from ab_sim.base.errors import SceneError
from ab_sim.drive.observation import Snapshot
from ab_sim.model.dynamics.assemble import system_of
from ab_sim.model.dynamics.registry import require_built_in
from ab_sim.model.dynamics.system import TURNS, System, has_motor, layout_of
from ab_sim.model.equations.neighbours import reduced
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene
from ab_sim.scene.sections import inertia_matrix


def with_disc(
    scene: Scene, eccentricity: float, further: float
) -> tuple[Scene, Callable[[Snapshot], Snapshot]]:
    """Return a scene with another disc, and the function that converts a drive's snapshot to it.

    Parameters
    ----------
    scene
        Scene with the previous disc.
    eccentricity
        Eccentricity of the rotor with the new disc [m].
    further
        Direction of the new unbalance from that of the old one [rad].

    Raises
    ------
    SceneError
        The eccentricity is invalid, or the rotor's inertia or the states of a deck model that is
        not built in would have to be turned.
    """
    if further:
        require_built_in(scene, f"another disc with disc_angle = {further:g} rad")
    if further and not turns_alike(scene):
        raise SceneError(
            f"disc_angle = {further:g} rad: rotor.inertia of {scene.name} is on axes that begin at "
            "the unbalance, and the disc's part of it is unknown; leave the angle at 0"
        )
    changes: dict[str, object] = {"rotor.eccentricity": eccentricity}
    runout = scene.effects.get("race_runout")
    if runout is not None and further:
        # The race stays where it is on the shaft.
        d = complex(runout.offset_1, runout.offset_2) * np.exp(-1j * further)
        name = "effects.race_runout"
        changes |= {f"{name}.offset_1": float(d.real), f"{name}.offset_2": float(d.imag)}
        changes[f"{name}.lobe_angle"] = reduced(runout.lobe_angle - further)[0]
    return changed_scene(scene, changes, "disc"), on_other_axes(system_of(scene), further)


def turns_alike(scene: Scene) -> bool:
    """Return whether turning the rotor about the shaft changes only its unbalance's direction."""
    if scene.rotor.inertia is None:
        return True
    inertia = inertia_matrix(scene.rotor.inertia)
    return bool(inertia[0, 0] == inertia[1, 1] and not np.triu(inertia, 1).any())


def on_other_axes(system: System, further: float) -> Callable[[Snapshot], Snapshot]:
    """Return the function that converts snapshots to rotating axes turned by an angle [rad].

    Nothing moves in the inertial frame.
    """
    layout, balls = layout_of(system), len(system.balls)

    def moved(kept: Snapshot) -> Snapshot:
        state, discrete_state = kept.state.copy(), kept.discrete_state.copy()
        if type(system.deck_model).AXES == 2:
            c, s = math.cos(further), math.sin(further)
            x, y = state[layout.deck].reshape(-1, 2).T
            state[layout.deck] = np.column_stack([c * x + s * y, c * y - s * x]).ravel()
        for ball, angle in enumerate(state[layout.angles].tolist()):
            within, turns = reduced(angle - further)
            state[layout.angles][ball] = within
            discrete_state[ball, TURNS] += int(turns)
        if has_motor(system.effects):
            psi, turns = reduced(float(state[layout.spindle][0]) + further)
            state[layout.spindle.start] = psi
            discrete_state[balls, TURNS] += int(turns)
        # The stepper's memory refers to the old axes.
        return kept._replace(
            state=state,
            discrete_state=discrete_state,
            memory=np.empty(0),
            schedule=kept.schedule.moved(0.0, further),
        )

    return moved
