"""The same deck told in another way moves in the same way."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory
from ab_sim.model.dynamics.deck_models.in_space import angular_velocity
from ab_sim.scene import Scene
from ab_sim.scene.sections import inertia_matrix
from tests.deck.coordinates import columns, tilt_of
from tests.deck.of_params import six
from tests.deck.scenes import ODD, Changes, made, odd
from tests.deck.test_against_reference import CLOSE, PUSHED, RUBBING, SLOW, SMOOTH
from tests.reference.plant import Array

FINE: Changes = {"solver": {"step": 2.5e-4}}
COMPANIES = [
    ("smooth", [{"effects": SMOOTH}]),
    ("rubbing", [{"effects": {**SMOOTH, **RUBBING}}, SLOW]),
    ("all", [{"effects": {**SMOOTH, **RUBBING}}, CLOSE, PUSHED]),
]
"""Two races without and with friction; one race, impacts and a motor."""
OF_THE_DECK = ("x", "y", "z", "qx", "qy", "qz", "wx", "wy", "wz")


def run(scene: Scene) -> Trajectory:
    """Long enough for all to move, and some events."""
    drive = Drive(scene, energy_balance=True)
    taken = drive.advance(400)
    smooth = "race_friction" not in scene.effects
    assert drive.steps_with_unresolved_events == 0 and (smooth or drive.events > 10)
    return taken


def turns(samples: Trajectory) -> Array:
    """From deck axes to the ground's, a matrix for each sample."""
    return Rotation.from_quat(columns(samples, "qx", "qy", "qz", "qw")).as_matrix()


def turning(samples: Trajectory) -> Array:
    """Angular velocity on deck axes, a row for each sample."""
    return columns(samples, "wx", "wy", "wz")


def assert_same(one: Array, other: Array, within: float = 1e-9) -> None:
    """But for rounding, grown with the motion."""
    scale = np.abs(one).max()
    assert np.ptp(one, axis=0).max() > 1e-3 * scale, "it moves"
    assert np.abs(other - one).max() < within * scale


def turned(raw: Changes, angle: float) -> Changes:
    """Everything turned about the shaft."""
    turn = Rotation.from_euler("z", angle)
    deck, start = raw["deck"], raw["start"]["deck"]
    pose = turn * Rotation.from_euler("ZXY", np.array(start["tilt"])[[2, 0, 1]]) * turn.inv()
    spin = turn.apply(angular_velocity(tuple(start["tilt"]), tuple(start["tilt_rate"])))
    tilt, rate = tilt_of(pose.as_quat()[None], spin[None])
    changes: Changes = {
        "deck": {
            "center": turn.apply(deck["center"]).tolist(),
            "inertia": six(turn.as_matrix() @ inertia_matrix(deck["inertia"]) @ turn.as_matrix().T),
        },
        "mounts": [
            {
                **mount,
                "position": turn.apply(mount["position"]).tolist(),
                "turned": (turn * Rotation.from_rotvec(mount["turned"])).as_rotvec().tolist(),
            }
            for mount in raw["mounts"]
        ],
        "start": {
            "angle": raw["start"]["angle"] + angle,
            "deck": {
                "position": turn.apply(start["position"]).tolist(),
                "velocity": turn.apply(start["velocity"]).tolist(),
                "tilt": tilt[0].tolist(),
                "tilt_rate": rate[0].tolist(),
            },
        },
        "effects": {"gravity": {"direction": raw["effects"]["gravity"]["direction"] + angle}},
    }
    return changes


@pytest.mark.parametrize(("company", "changes"), COMPANIES)
def test_turned_about_the_shaft(company: str, changes: list[Changes]) -> None:
    scene, angle = odd(company, FINE, *changes), 0.9
    one, other = run(scene), run(made(scene.as_mapping(), turned(scene.as_mapping(), angle)))
    turn = Rotation.from_euler("z", angle).as_matrix()
    assert_same(one.position @ turn.T, other.position)
    assert_same(one.velocity @ turn.T, other.velocity)
    assert_same(turn @ turns(one) @ turn.T, turns(other))
    assert_same(turning(one) @ turn.T, turning(other))
    assert_same(one.ball_angles, other.ball_angles)


@pytest.mark.parametrize(("company", "changes"), COMPANIES)
def test_heights_counted_from_another_point(company: str, changes: list[Changes]) -> None:
    """C lies elsewhere on the shaft, and all else where it was."""
    scene, up = odd(company, FINE, *changes), np.array([0.0, 0.0, 0.011])
    raw: Any = scene.as_mapping()
    start = raw["start"]["deck"]
    turn = Rotation.from_euler("ZXY", np.array(start["tilt"])[[2, 0, 1]])
    spin = angular_velocity(tuple(start["tilt"]), tuple(start["tilt_rate"]))
    moved = (start["position"] + turn.apply(up) - up).tolist()
    speed = (start["velocity"] + turn.apply(np.cross(spin, up))).tolist()
    other = made(
        raw,
        {
            "rotor": {"height": raw["rotor"]["height"] - up[2]},
            "deck": {"center": (raw["deck"]["center"] - up).tolist()},
            "race": {"height": [height - up[2] for height in raw["race"]["height"]]},
            "mounts": [
                {**mount, "position": (mount["position"] - up).tolist()} for mount in raw["mounts"]
            ],
            "start": {"deck": {"position": moved, "velocity": speed}},
        },
    )
    here, there = run(scene), run(other)
    assert_same(here.position + turns(here) @ up - up, there.position)
    carried = np.einsum("sij,sj->si", turns(here), np.cross(turning(here), up))
    assert_same(here.velocity + carried, there.velocity)
    assert_same(turns(here), turns(there))
    assert_same(turning(here), turning(there))
    assert_same(here.ball_angles, there.ball_angles)


def test_mounts_in_two_halves_with_their_axes_in_another_order() -> None:
    whole = {"hardening_suspension": {"cubic_stiffness": 1e9}}
    halves: list[Changes] = []
    for mount in ODD["mounts"]:
        axes = Rotation.from_rotvec(mount.get("turned", [0.0, 0.0, 0.0]))
        stiffness, damping = (
            np.broadcast_to(mount[key], 3) / 2 for key in ("stiffness", "damping")
        )
        # First x, y, z; then y, z, x of the first.
        for order in ([0, 1, 2], [1, 2, 0]):
            halves.append(
                {
                    "position": mount["position"],
                    "stiffness": stiffness[order].tolist(),
                    "damping": damping[order].tolist(),
                    "turned": Rotation.from_matrix(axes.as_matrix()[:, order]).as_rotvec().tolist(),
                }
            )
    one = run(odd("smooth", FINE, {"effects": whole}))
    half = {"hardening_suspension": {"cubic_stiffness": 0.5e9}}
    other = run(odd("smooth", FINE, {"effects": half, "mounts": halves}))
    assert_same(one.ball_angles, other.ball_angles)
    for channel in OF_THE_DECK:
        assert_same(one[channel], other[channel])


def test_balls_in_another_order() -> None:
    """Of two races; each keeps its own."""
    swapped: Changes = {
        "balls": {key: ODD["balls"][key][::-1] for key in ("mass", "radius", "race")},
        "start": {key: ODD["start"][key][::-1] for key in ("ball_angles", "ball_rates")},
    }
    changes = FINE, {"effects": {**SMOOTH, **RUBBING}}, SLOW
    one, other = run(odd("rubbing", *changes)), run(odd("rubbing", *changes, swapped))
    assert_same(one.ball_angles, other.ball_angles[:, ::-1])
    for channel in OF_THE_DECK:
        assert_same(one[channel], other[channel])


def test_two_races_at_one_height_are_one() -> None:
    """To the bit: a race is nothing but the height of its balls."""
    changes: list[Changes] = [{"effects": {**SMOOTH, **RUBBING}}, SLOW]
    two = odd("rubbing", *changes, {"race": {"height": [0.007, 0.007]}})
    one = odd("rubbing", *changes, {"race": {"height": 0.007}, "balls": {"race": 0}})
    np.testing.assert_array_equal(run(two).samples, run(one).samples)
