"""Another disc on a drive: an unbalance of another size, in another direction.

Rotating axis 1 points at the unbalance, and balls' angles are from there. A disc whose unbalance
lies further by an angle turns that axis, and nothing else moves: what was counted from it is less
by the angle, and the spindle's angle, which is the axis' from the ground, is more.
"""

import math
from collections.abc import Callable

import numpy as np

from ab_sim.drive.observation import Snapshot
from ab_sim.dynamics.assemble import system_of
from ab_sim.dynamics.layout import layout_of
from ab_sim.dynamics.race.neighbours import reduced
from ab_sim.dynamics.system import TURNS, has_motor
from ab_sim.errors import SceneError
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene


def with_disc(
    scene: Scene, eccentricity: float, further: float
) -> tuple[Scene, Callable[[Snapshot], Snapshot]]:
    """A scene with another disc, and what takes a drive's snapshot over to it.

    Args:
        scene: of the disc before.
        eccentricity: of the rotor with the disc [m].
        further: direction of the new unbalance from that of the old one [rad].

    Raises:
        SceneError: the eccentricity is none, or the rotor's inertia would have to be turned.
    """
    if scene.rotor.inertia is not None and further:
        raise SceneError(
            f"disc_angle = {further:g} rad: rotor.inertia of {scene.name} is on axes that begin at "
            "the unbalance, and what of it is the disc's is not known; leave the angle at 0"
        )
    changes: dict[str, object] = {"rotor.eccentricity": eccentricity}
    runout = scene.effects.get("race_runout")
    if runout is not None and further:
        # The race stays where it is on the shaft.
        d = complex(runout.offset_1, runout.offset_2) * np.exp(-1j * further)
        name = "effects.race_runout"
        changes |= {f"{name}.offset_1": float(d.real), f"{name}.offset_2": float(d.imag)}
        changes[f"{name}.lobe_angle"] = reduced(runout.lobe_angle - further)[0]
    other = changed_scene(scene, changes, "disc")
    system = system_of(scene)
    layout, balls = layout_of(system), scene.balls.count

    def moved(kept: Snapshot) -> Snapshot:
        state, modes = kept.state.copy(), kept.modes.copy()
        if type(system.carrier).WAYS == 2:
            c, s = math.cos(further), math.sin(further)
            carrier = state[layout.carrier].reshape(-1, 2)
            state[layout.carrier] = (carrier @ np.array([[c, -s], [s, c]])).ravel()
        for ball, angle in enumerate(state[layout.angles].tolist()):
            within, turns = reduced(angle - further)
            state[layout.angles][ball] = within
            modes[ball, TURNS] += int(turns)
        if has_motor(system.effects):
            psi, turns = reduced(float(state[layout.spindle][0]) + further)
            state[layout.spindle.start] = psi
            modes[balls, TURNS] += int(turns)
        # What a stepper remembers is on the old axes.
        return kept._replace(
            state=state, modes=modes, memory=np.empty(0), profile=kept.profile.moved(0.0, further)
        )

    return other, moved
