"""The plane is a limit of the deck: with mounts stiff against turning, tilt and heave.

Four mounts share the planar suspension's stiffness and damping. They lie at the corners of a
square, and are stiff as its width squared against turning about the shaft. Four others, stiff along
the shaft only, hold the deck against tilt and heave.
"""

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene import Scene
from tests.deck.scenes import Changes, made
from tests.effects.parts import scene_of

PLANAR: Changes = {
    "rotor": {"eccentric_mass": 0.08},
    "start": {"speed": 90.0, "ball_angles": [0.6, -0.9]},
    "effects": {
        "viscous_drag": {"coefficient": 0.1},
        "unequal_suspension": {
            "stiffness_2": 1400.0,
            "damping_2": 0.3,
            "axis_angle": 0.4,
        },
        "hardening_suspension": {"cubic_stiffness": 1e8},
        "gravity": {"tilt": np.pi / 2, "direction": 0.7},
        "race_runout": {"offset_1": 3e-4, "offset_2": -2e-4, "lobe": 2e-4, "lobe_angle": 0.3},
    },
}
RUBBING: Changes = {
    "effects": {
        "race_friction": {"coefficient": 0.03},
        "motor": {"torque_limit": 2e-3},
    }
}
FLAT: Changes = {}
TALL: Changes = {
    "rotor": {"height": 6e-3},
    "deck": {"center": [3e-3, -2e-3, -4e-3]},
    "race": {"height": 5e-3},
}
"""The deck's mass centre beside the shaft, and everything at a height of its own."""


def twin(scene: Scene, stiffness: float, step: float, *changes: Changes) -> Scene:
    """The planar scene's deck in space.

    Parameters
    ----------
    scene
        In the plane.
    stiffness
        Against turning, tilt and heave, in a unit in which 1 is not stiff at all.
    step
        Of the stepper [s].
    changes
        Laid over the deck's scene.
    """
    raw, effects = scene.as_mapping(), dict(scene.as_mapping()["effects"])
    spring, own, inertia = effects.pop("unequal_suspension"), scene.rotor, 1e-5
    in_plane: Changes = {
        "stiffness": [spring["stiffness_1"] / 4, spring["stiffness_2"] / 4, 0.0],
        "damping": [spring["damping_1"] / 4, spring["damping_2"] / 4, 0.0],
        "turned": [0.0, 0.0, spring["axis_angle"]],
    }
    along: Changes = {
        "stiffness": [0.0, 0.0, 1000.0 * stiffness],
        "damping": [0.0, 0.0, 0.5 * stiffness**0.5],
    }
    mounts = []
    for mount, half_width in ((in_plane, 0.1 * stiffness**0.5), (along, 0.1)):
        for i, j in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
            mounts.append({"position": [i * half_width, j * half_width, 0.0], **mount})
    cubic = effects["hardening_suspension"]["cubic_stiffness"] / len(mounts)
    effects["hardening_suspension"] = {"cubic_stiffness": cubic}
    if "motor" in effects:
        turning = effects["motor"]["rotor_inertia"] - inertia
        effects["motor"] = {**effects["motor"], "rotor_inertia": turning}
    raw |= {
        "rotor": {
            "mass": scene.total_mass - scene.balls.total_mass,
            "eccentric_mass": own.eccentric_mass,
            "eccentricity": own.eccentricity,
            "inertia": [0.5 * inertia, 0.5 * inertia, inertia],
        },
        "deck": {"inertia": [1e-4, 1e-4, 2e-4]},
        "mounts": mounts,
        "effects": effects,
        "solver": {"stepper": "rk8", "step": step},
    }
    return made(raw, *changes)


def moved(scene: Scene, every: int = 1) -> tuple[Trajectory, int]:
    """The run for 0.3 s, relative to where the deck starts, and how many events there were."""
    drive = Drive(scene, energy_balance=True)
    begin = drive.present()
    taken = drive.advance(round(0.3 / drive.step), every)
    assert drive.steps_with_unresolved_events == 0
    for axis in "xy":
        taken[axis][:] -= begin[axis]
    return taken, drive.events


@pytest.mark.parametrize("heights", [FLAT, TALL], ids=["all at one height", "heights"])
@pytest.mark.parametrize(("company", "changes"), [("smooth", {}), ("all", RUBBING)])
def test_difference_falls_as_one_over_the_stiffness(
    company: str, changes: Changes, heights: Changes
) -> None:
    """Over three decades of it; also where balls slide and stick, and a motor drives them."""
    planar = scene_of(company, PLANAR, changes, {"solver": {"step": 5e-4}})
    flat, events = moved(planar)
    assert np.ptp(flat.ball_angles, axis=0).min() > 0.5 and flat.whirl.max() > 1e-4
    assert events > 10 or company == "smooth"
    gaps = []
    for stiffness, step in ((10.0, 1e-4), (100.0, 5e-5), (1e3, 2e-5), (1e4, 1e-5)):
        run, met = moved(twin(planar, stiffness, step, heights), round(5e-4 / step))
        assert met == events
        deck = np.abs(run.position[:, :2] - flat.position).max() / 0.01
        gaps.append([deck, np.abs(run.ball_angles - flat.ball_angles).max()])
        tilt = np.hypot(run["qx"], run["qy"]).max()
        assert tilt < 1e-15 if heights is FLAT else tilt > 0.1 * deck, tilt
    falls = np.array(gaps[:-1]) / gaps[1:]
    np.testing.assert_allclose(falls, 10.0, rtol=0.4)
    np.testing.assert_allclose(falls[-1], 10.0, rtol=0.05)
