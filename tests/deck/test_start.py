"""Start states of both plants: every coordinate and speed, where a deck hangs, an earlier end."""

import numpy as np
import pytest

from ab_sim.base.errors import SceneError
from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory
from ab_sim.model.dynamics.assemble import start_state, system_of
from ab_sim.model.dynamics.system import System
from ab_sim.scene import Scene, load_scene
from tests.deck.coordinates import columns, coordinates
from tests.deck.scenes import ODD, Changes, made, odd
from tests.deck.test_against_reference import GRAVITY, HARDENING, OVAL, RAMP, SMOOTH
from tests.effects.parts import scene_of
from tests.reference import averaged, linearise
from tests.reference.of_scene import deck_of

POSITION, VELOCITY = (2e-4, -1e-4, 3e-4), (0.05, -0.02, 0.04)


def at_start(scene: Scene) -> Trajectory:
    return Drive(scene, energy_balance=True).present()


@pytest.mark.parametrize("tilt", [(0.3, -0.7, 1.1), (-1.5, 3.0, -3.0), (0.0, 0.0, 2.0)])
def test_a_deck_in_space_starts_as_it_is_told(tilt: tuple[float, ...]) -> None:
    rates = (1.0, -2.0, 1.5)
    deck: Changes = {"position": POSITION, "velocity": VELOCITY, "tilt": tilt, "tilt_rate": rates}
    now = at_start(odd("plain", {"start": {"deck": deck}}))
    places, speeds = coordinates(now)
    np.testing.assert_allclose(places[0, 3:], [*tilt, 0.5, 2.6], rtol=0.0, atol=2e-15)
    np.testing.assert_allclose(speeds[0, 3:], [*rates, 4.0, -3.0], rtol=0.0, atol=2e-13)
    assert tuple(now.position[0]) == POSITION and tuple(now.velocity[0]) == VELOCITY
    assert (now["angle"][0], now["speed"][0]) == (0.8, 110.0)


def test_a_deck_in_the_plane_starts_as_it_is_told() -> None:
    """Also where gravity has it hang aside, and at any angle of the spindle."""
    start: Changes = {
        "angle": 0.7,
        "ball_rates": [3.0, -4.0],
        "deck": {"position": POSITION[:2], "velocity": VELOCITY[:2]},
    }
    now = at_start(scene_of("smooth", {"start": start, "effects": {"gravity": {"tilt": 1.2}}}))
    np.testing.assert_allclose(now.position[0], POSITION[:2], rtol=1e-14)
    np.testing.assert_allclose(now.velocity[0], VELOCITY[:2], rtol=1e-14)
    assert now.ball_angles[0].tolist() == [0.3, -0.9]
    assert now.ball_rates[0].tolist() == [3.0, -4.0]


@pytest.mark.parametrize("plane", [True, False], ids=["in the plane", "in space"])
def test_from_an_earlier_end_it_goes_on(plane: bool) -> None:
    changes: Changes = {"effects": OVAL if plane else SMOOTH, "solver": {"step": 2.5e-4}}
    scene = scene_of("smooth", changes) if plane else odd("smooth", changes, RAMP)
    drive = Drive(scene, energy_balance=True)
    first = drive.advance(150)
    later = drive.advance(50)
    places, rates = (part[-1].tolist() for part in coordinates(first)) if not plane else ([], [])
    deck: Changes = {
        "position": first.position[-1].tolist(),
        "velocity": first.velocity[-1].tolist(),
    }
    if not plane:
        deck |= {"tilt": places[3:6], "tilt_rate": rates[3:6]}
    start: Changes = {
        "speed": float(first["speed"][-1]),
        "angle": float(first["angle"][-1]),
        "ball_angles": first.ball_angles[-1].tolist(),
        "ball_rates": first.ball_rates[-1].tolist(),
        "deck": deck,
    }
    again = Drive(made(scene.as_mapping(), {"start": start}), energy_balance=True)
    run = again.advance(50)
    names = [name for name in run.channels if name not in ("step", "time")]
    assert np.ptp(later.position, axis=0).min() > 1e-6
    scale = np.abs(columns(later, *names)).max(axis=0)
    assert np.abs((columns(run, *names) - columns(later, *names)) / scale).max() < 1e-10


STILL: Changes = {
    "rotor": {"eccentricity": 0.0},
    "balls": {"count": 0, "mass": None, "radius": None, "race": None},
    "start": {"speed": 0.0, "ball_angles": None, "ball_rates": None, "deck": None},
}
"""Without unbalance and balls, and at rest."""


@pytest.mark.parametrize("stiff", [1.0, 0.0], ids=["springs", "hardening alone"])
def test_by_default_a_deck_hangs_at_rest(stiff: float) -> None:
    """On mounts of any kind, aslant: in a second nothing moves."""
    soft = [{**m, "stiffness": [stiff * k for k in m["stiffness"]]} for m in ODD["mounts"]]
    scene = odd("rubbing", STILL, {"effects": {**GRAVITY, **HARDENING}, "mounts": soft})
    drive = Drive(scene, energy_balance=True)
    begin = drive.present()
    assert begin["z"][0] < -1e-4 and np.abs(begin["qx"][0]) > 1e-4
    run = drive.advance(2000)
    assert np.abs(run.velocity).max() < 1e-12
    assert np.abs(columns(run, "wx", "wy", "wz")).max() < 1e-11
    if stiff:
        rest = linearise(averaged(deck_of(scene))).rest
        np.testing.assert_allclose(coordinates(begin).places[0, :6], rest, rtol=0.0, atol=1e-13)


def test_place_and_tilt_have_their_defaults_each() -> None:
    effects = {"effects": {**GRAVITY, **HARDENING}}
    hangs = coordinates(at_start(odd("rubbing", STILL, effects))).places[0]
    place: Changes = {"start": {"deck": {"position": POSITION}}}
    tilt: Changes = {"start": {"deck": {"tilt": [0.1, 0.2, 0.3]}}}
    placed = coordinates(at_start(odd("rubbing", STILL, effects, place))).places[0]
    tilted = coordinates(at_start(odd("rubbing", STILL, effects, tilt))).places[0]
    assert tuple(placed[:3]) == POSITION and placed[3:6] == pytest.approx(hangs[3:6], abs=1e-15)
    assert (
        tilted[3:6] == pytest.approx([0.1, 0.2, 0.3]) and tilted[:3].tolist() == hangs[:3].tolist()
    )
    turning: Changes = {"start": {"deck": {"tilt_rate": [1.0, 2.0, 3.0]}}}
    rates = coordinates(at_start(odd("rubbing", STILL, effects, turning))).rates[0]
    assert rates[3:6] == pytest.approx([1.0, 2.0, 3.0], rel=1e-13)


@pytest.mark.parametrize("cubic", [1e5, 1e8, 1e11])
@pytest.mark.parametrize("tilt", [1e-9, 1.2, 1.5707963, np.pi / 2, np.pi])
def test_a_deck_hangs_whichever_way_gravity_points(tilt: float, cubic: float) -> None:
    """Pulled the other way, the feeding deck hangs mirrored, and a deck in the plane turned."""

    def systems(name: str, direction: float) -> tuple[Scene, System]:
        asked = {"gravity.tilt": tilt, "gravity.direction": direction}
        asked["hardening_suspension.cubic_stiffness"] = cubic
        scene = load_scene(name, [f"effects.{key}={value!r}" for key, value in asked.items()])
        return scene, system_of(scene)

    def in_space(direction: float) -> np.ndarray:
        return start_state(*systems("feeding-deck", direction))[:7]

    sags = []
    for direction in (0.0, 1e-9, 0.7, np.pi / 2):
        x, y, z, w, about_x, about_y, about_z = in_space(direction)
        mirrored = [-x, y, z, w, about_x, -about_y, -about_z]
        np.testing.assert_allclose(in_space(np.pi - direction), mirrored, rtol=0.0, atol=1e-14)
        assert z * np.cos(tilt) <= 0.0 < np.hypot(y, z)
        deck = systems("nsc-case-1", direction)[1].deck_model
        sags.append(np.exp(-1j * direction) * (deck.sag_x + 1j * deck.sag_y))
    np.testing.assert_allclose(sags, sags[0], rtol=1e-12)
    assert sags[0].real > 0.0


def test_without_gravity_it_starts_where_the_mounts_are_relaxed() -> None:
    now = at_start(odd("rubbing", STILL))
    assert not now.position.any() and not now.velocity.any()
    assert columns(now, "qw", "qx", "qy", "qz")[0].tolist() == [1.0, 0.0, 0.0, 0.0]


def test_what_cannot_hang_has_to_be_told_where_it_starts() -> None:
    loose: Changes = {"mounts": [{**ODD["mounts"][0], "stiffness": [0.0, 10.0, 0.0]}]}
    falling: Changes = {"effects": {"gravity": {"acceleration": 9.8}}}
    for mounts in (loose, {"mounts": []}):
        scene = odd("rubbing", STILL, mounts, falling)
        with pytest.raises(SceneError, match="effects.gravity: no place .*start.deck"):
            Drive(scene, energy_balance=True)
    told: Changes = {"start": {"deck": {"position": [0, 0, 0], "tilt": [0, 0, 0]}}}
    drive = Drive(odd("rubbing", STILL, {"mounts": []}, falling, told), energy_balance=True)
    assert drive.advance(200)["z"][-1] == pytest.approx(-0.5 * 9.8 * 0.1**2, rel=1e-12)
