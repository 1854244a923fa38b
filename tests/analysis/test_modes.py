"""Natural vibration: against two independent derivations, closed forms, and where modes end.

Sources: deck_oracle.json's modes; Kim and Chung (2002), six frequencies (EQUATIONS.md section 4);
tests/reference/deck_modes.py, which has its matrices from a Lagrangian by complex steps.
"""

import cmath
import json
import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from ab_sim.analysis.modes import Mode, campbell, modal_assurance, modes_of, moving, vibration_of
from ab_sim.base.errors import SceneError
from ab_sim.engine.integrate.vector_field import VectorField
from ab_sim.model.dynamics.assemble import linearised, start_discrete_state, start_state, system_of
from ab_sim.model.dynamics.deck_models.in_space import angular_velocity
from ab_sim.model.spindle import Ramp, ScheduledSegment
from ab_sim.scene import Scene, load_scene, scene_names
from tests.deck.of_params import scene_of
from tests.deck.scenes import ODD, Changes, made
from tests.reference import deck_modes
from tests.reference.cases import deck_oracle, deck_params
from tests.reference.of_scene import deck_of

(KIM_CHUNG,) = deck_oracle()["modes"]
PUBLISHED = [179, 180, 181, 325, 335, 347]
STILL = np.zeros(6)
RING = scene_of(deck_params(KIM_CHUNG["ring_params"]), STILL, STILL, effects={})
"""The oracle's deck, its disc and balls averaged by the oracle."""


def assert_same(mode: Mode, eigenvalue: complex, shape: np.ndarray, rel: float) -> None:
    assert mode.eigenvalues[0] == pytest.approx(eigenvalue, rel=rel)
    assert mode.eigenvalues[1] == mode.eigenvalues[0].conjugate()
    assert mode.frequency == pytest.approx(abs(eigenvalue), rel=rel)
    assert mode.damped_frequency == pytest.approx(eigenvalue.imag, rel=rel)
    ratio = -eigenvalue.real / abs(eigenvalue)
    assert mode.damping_ratio == pytest.approx(ratio, rel=10 * rel)
    np.testing.assert_allclose(mode.shape, shape, rtol=0.0, atol=10 * rel)


@pytest.mark.parametrize("case", KIM_CHUNG["speeds"], ids=lambda case: f"{case['speed']:g} rad/s")
def test_the_oracle_s_modes(case: dict[str, Any]) -> None:
    found = modes_of(linearised(system_of(RING)), case["speed"])
    for mode, e in zip(found, case["modes"], strict=True):
        shape = np.array(e["shape_re"]) + 1j * np.array(e["shape_im"])
        assert_same(mode, complex(e["re"], e["im"]), shape, rel=1e-11)
        assert mode.damping_ratio == pytest.approx(e["damping_ratio"], rel=1e-10)


def test_the_scene_that_ships_has_the_oracle_s_and_the_published_frequencies() -> None:
    """Its eccentricity is rounded to six digits, which 1e-9 forgives."""
    vibration = vibration_of(load_scene("feeding-deck"))
    found = [mode.frequency for mode in vibration.modes]
    np.testing.assert_allclose(found, PUBLISHED, rtol=0.0, atol=0.5)
    at_rest = KIM_CHUNG["speeds"][0]["modes"]
    np.testing.assert_allclose(found, [mode["natural"] for mode in at_rest], rtol=1e-9)
    # Damping in proportion to stiffness leaves the undamped frequencies as they are.
    np.testing.assert_allclose(found, KIM_CHUNG["undamped_at_rest"], rtol=1e-9)


HEAVY = {"gravity": {"tilt": 0.7, "direction": 0.4, "acceleration": 300.0}}
LOADS: dict[str, Changes] = {
    "weightless": {},
    "rolling": {"effects": {"ball_spin": {}}},
    "hanging": {"effects": HEAVY},
    "hardened": {"effects": {**HEAVY, "hardening_suspension": {"cubic_stiffness": 1e9}}},
    "motor": {
        "effects": {
            "motor": {"rotor_inertia": 3e-6, "torque_limit": 1e-2, "proportional_gain": 5e-3}
        }
    },
}
for load in LOADS.values():
    if "ball_spin" not in load.get("effects", {}):
        load["balls"] = {"radius": None}


@pytest.mark.parametrize("speed", [0.0, 110.0, -800.0])
@pytest.mark.parametrize("load", LOADS)
def test_an_independent_derivation_without_any_symmetry(load: str, speed: float) -> None:
    scene = made(ODD, LOADS[load])
    about, p = linearised(system_of(scene)), deck_of(scene)
    rest = deck_modes.linearise(p, speed).rest
    heavy = "gravity" in scene.effects
    assert heavy == (np.abs(rest[:3]).max() > 1e-3) == (np.abs(rest[3:]).max() > 1e-3)
    np.testing.assert_allclose(about.rest[:3], rest[:3], rtol=1e-9, atol=1e-15)
    # Small turns on deck axes, from changes of the angles about those at rest.
    turns = np.array([angular_velocity(tuple(rest[3:]), tuple(unit)) for unit in np.eye(3)]).T
    for mode, e in zip(modes_of(about, speed), deck_modes.modes(p, speed), strict=True):
        shape = np.concatenate([e.shape[:3], turns @ e.shape[3:]])
        assert_same(mode, e.eigenvalue, shape / shape[np.abs(shape).argmax()], rel=1e-11)


# The kernel that runs

RINGS: Changes = {
    "rotor": {"eccentricity": 0.0, "inertia": [5.6e-6, 5.6e-6, 1.1e-5]},
    "balls": {"count": 0, "mass": None, "radius": None, "race": None},
    "effects": {
        "gravity": {"tilt": 0.7, "direction": 0.4, "acceleration": 300.0},
        "hardening_suspension": {"cubic_stiffness": 1e9},
    },
    "start": {"ball_angles": None, "ball_rates": None, "deck": None},
}
"""A symmetric rotor, so that the deck rests while it turns."""
WEIGHTLESS: Changes = {
    "effects": {"gravity": {"acceleration": 0.0}, "hardening_suspension": {"cubic_stiffness": 0.0}}
}


def kernel_s_eigenvalues(scene: Scene) -> np.ndarray:
    """Of the exact Jacobian at the start, which is at rest.

    On coordinates without a constraint: dq = q (0, phi) / 2 of the quaternion.
    """
    system, steady = system_of(scene), ScheduledSegment(0.0, 1.0, 0.0, Ramp(scene.start.speed, 0.0))
    field, state = (
        VectorField(system, steady, start_discrete_state(scene, system)),
        start_state(scene, system),
    )
    assert len(state) == 13 and np.abs(field.slope(0.0, state)).max() < 1e-9
    w, x, y, z = state[3:7]
    turned = 0.5 * np.array([[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]])
    out, back = np.zeros((13, 12)), np.zeros((12, 13))
    for rows, columns, part in ((slice(0, 3), slice(0, 3), np.eye(3)),
        (slice(3, 7), slice(3, 6), turned), (slice(7, 13), slice(6, 12), np.eye(6)),
    ):  # fmt: skip
        out[rows, columns], back[columns, rows] = part, np.linalg.pinv(part)
    return np.linalg.eigvals(back @ field.jacobian(0.0, state) @ out)


@pytest.mark.parametrize("speed", [0.0, 110.0, -800.0])
@pytest.mark.parametrize("load", [{}, WEIGHTLESS], ids=["hanging, hardened", "weightless"])
def test_the_exact_jacobian_of_the_kernel_at_rest(load: Changes, speed: float) -> None:
    scene = made(ODD, RINGS, load, {"start": {"speed": speed}})
    found = sorted(kernel_s_eigenvalues(scene), key=abs)
    ours = modes_of(linearised(system_of(scene)), speed)
    theirs = deck_modes.modes(deck_of(scene), speed)
    for k, (mode, independent) in enumerate(zip(ours, theirs, strict=True)):
        pair = sorted(found[2 * k : 2 * k + 2], key=lambda value: value.imag, reverse=True)
        assert pair == pytest.approx(list(mode.eigenvalues), rel=1e-9)
        assert pair[0] == pytest.approx(independent.eigenvalue, rel=1e-9)


def test_the_exact_jacobian_of_the_published_set() -> None:
    found = sorted(kernel_s_eigenvalues(RING), key=abs)
    at_rest = KIM_CHUNG["speeds"][0]
    assert at_rest["speed"] == RING.start.speed == 0.0
    want = [complex(mode["re"], mode["im"]) for mode in at_rest["modes"]]
    assert [value for value in found if value.imag > 0] == pytest.approx(want, rel=1e-9)


# The plane


def test_an_isotropic_suspension_whirls_both_ways(scene: Any) -> None:
    """(s^2 + c s / M + k / M) = 0, of (x, y) = (1, -i), which circles forward, and its mirror."""
    M, k, c = 0.1, 1000.0, 0.2
    root = (-c + cmath.sqrt(c**2 - 4 * M * k)) / (2 * M)
    backward, forward = vibration_of(scene(), 300.0).modes
    assert_same(backward, root, np.array([1.0, 1j]), rel=1e-12)
    assert_same(forward, root, np.array([1.0, -1j]), rel=1e-12)
    assert (backward.sense, forward.sense) == ("backward", "forward")
    assert (backward.whirl, forward.whirl) == pytest.approx((-1.0, 1.0))
    (other,) = (mode for mode in vibration_of(scene(), -300.0).modes if mode.sense == "forward")
    assert_same(other, root, np.array([1.0, 1j]), rel=1e-12)


def test_an_unequal_suspension_moves_to_and_fro_along_its_axes(scene: Any) -> None:
    M, angle = 0.1, 0.6
    axes = {"stiffness_1": 1e3, "damping_1": 0.2, "stiffness_2": 2e3, "damping_2": 0.5}
    unequal = {"unequal_suspension": {**axes, "axis_angle": angle}, "suspension": None}
    about = linearised(system_of(scene(effects=unequal)))
    one, two = modes_of(about, 300.0)
    along = np.array([1.0, math.tan(angle)])
    across = np.array([-math.tan(angle), 1.0])
    assert_same(one, (-0.2 + cmath.sqrt(0.2**2 - 4e3 * M)) / (2 * M), along, rel=1e-12)
    assert_same(two, (-0.5 + cmath.sqrt(0.5**2 - 8e3 * M)) / (2 * M), across, rel=1e-12)
    assert one.sense is two.sense is None


def test_a_hardening_suspension_about_where_the_deck_hangs(scene: Any) -> None:
    """k + 3 k_3 s^2 along the sag s, k + k_3 s^2 across; (k + k_3 s^2) s = M g."""
    M, k, k_3, sag, down = 0.1, 1000.0, 1e9, 1e-3, 0.4
    gravity = (k + k_3 * sag**2) * sag / M
    effects = {
        "hardening_suspension": {"cubic_stiffness": k_3},
        "gravity": {"tilt": math.pi / 2, "direction": down, "acceleration": gravity},
    }
    vibration = vibration_of(scene(effects=effects))
    assert vibration.linearised.rest == pytest.approx((sag * math.cos(down), sag * math.sin(down)))
    across, along = vibration.modes
    assert across.frequency == pytest.approx(math.sqrt((k + k_3 * sag**2) / M), rel=1e-11)
    assert along.frequency == pytest.approx(math.sqrt((k + 3 * k_3 * sag**2) / M), rel=1e-11)
    np.testing.assert_allclose(along.shape, [1.0, math.tan(down)], rtol=1e-11)
    np.testing.assert_allclose(across.shape, [-math.tan(down), 1.0], rtol=1e-11)


# A deck of two symmetries, whose tilt is known


def tilt_of(scene: Scene, speed: float) -> dict[str, complex]:
    """J_t z'' + (c_t - i J_p w) z' + k_t z = 0 of z = tilt about x + i tilt about y."""
    m, R, h, n = 5e-5, 0.03, 0.01, 4
    ring = n * m * R**2 + 0.03 * (1e-5) ** 2
    J_t, J_p = 1.2e-4 + 9e-6 + n * m * h**2 + ring / 2, 1.35e-5 + ring
    lever = sum(mount.position[1] ** 2 for mount in scene.mounts)
    k_t, c_t = 1063.1 * lever, 0.6 * lever
    values = np.roots([J_t, c_t - 1j * J_p * speed, k_t])
    # exp(i w t) turns forward; of the other the conjugate is the mode.
    one, two = sorted(values, key=lambda value: value.imag)
    return {"backward": complex(one.conjugate()), "forward": complex(two)}


SYMMETRIC = load_scene("couple-unbalance")


@pytest.mark.parametrize("speed", [0.0, 180.0, 500.0])
def test_gyroscopic_moments_part_forward_from_backward(speed: float) -> None:
    tilts = [m for m in vibration_of(SYMMETRIC, speed).modes if abs(m.shape[3]) > 0.5]
    expected = tilt_of(SYMMETRIC, speed)
    assert {mode.sense for mode in tilts} == {"forward", "backward"}
    for mode in tilts:
        assert mode.eigenvalues[0] == pytest.approx(expected[str(mode.sense)], rel=1e-11)
        assert abs(mode.whirl) == pytest.approx(1.0)


def test_branches_are_followed_through_a_crossing_and_met_once_per_revolution() -> None:
    """Forward tilt starts below the turn about the shaft, and ends above."""
    about = linearised(system_of(SYMMETRIC))
    found = campbell(about, np.linspace(0.0, 600.0, 61))

    def name(mode: Mode) -> tuple[str, ...]:
        return (*sorted(moving(about, mode)), str(mode.sense))

    tilts = [("tilt about x", "tilt about y", sense) for sense in ("backward", "forward")]
    turn = ("turn about z", "None")
    at = {}
    for branch in found.branches:
        (one,) = {name(mode) for mode in branch}
        at[one] = np.array([mode.frequency for mode in branch])
        assert min(modal_assurance(about, [p], [q]).item() for p, q in pairwise(branch)) > 0.99
    assert len(at) == 6
    backward, forward = (at[tilt] for tilt in tilts)
    assert np.ptp(at[turn]) < 1e-9
    assert forward[0] < at[turn][0] and forward[-1] > at[turn][-1]
    assert (np.diff(forward) > 0).all() and (np.diff(backward) < 0).all()
    met = {name(mode): speed for speed, mode in found.critical}
    assert met.keys() == at.keys() and len(found.critical) == 6
    for tilt in tilts:
        assert abs(tilt_of(SYMMETRIC, met[tilt])[tilt[-1]]) == pytest.approx(met[tilt], rel=1e-10)
    assert met[turn] == pytest.approx(at[turn][0], rel=1e-10)


# Where modes end


def damped(factor: float) -> Scene:
    raw = load_scene("feeding-deck").as_mapping()
    for mount in raw["mounts"]:
        mount["damping"] = factor * mount["damping"]
    return made(raw)


def test_damped_more_than_critically() -> None:
    """Damping in proportion: c makes no other frequency, and a ratio in proportion."""
    slack, stiff = (vibration_of(damped(factor)).modes for factor in (1.0, 15.0))
    for light, heavy in zip(slack, stiff, strict=True):
        assert light.frequency == pytest.approx(heavy.frequency, rel=1e-9)
        assert light.damping_ratio is not None
        assert heavy.damping_ratio == pytest.approx(15.0 * light.damping_ratio, rel=1e-9)
        np.testing.assert_allclose(heavy.shape, light.shape, atol=1e-8)
    assert [mode.damped_frequency == 0.0 for mode in stiff] == [False] * 3 + [True] * 3
    ratio, (slow, fast) = stiff[-1].damping_ratio, stiff[-1].eigenvalues
    assert ratio is not None and ratio > 1.0
    roots = np.roots([1.0, 2.0 * ratio * stiff[-1].frequency, stiff[-1].frequency ** 2])
    assert [fast.real, slow.real] == pytest.approx(sorted(roots))


def test_equal_modes_damped_more_than_critically() -> None:
    raw = SYMMETRIC.as_mapping()
    for mount in raw["mounts"]:
        mount["damping"] = 20.0
    k, m, c = 4 * 1063.1, 0.1302, 80.0
    modes = vibration_of(made(raw)).modes
    assert [mode.frequency for mode in modes[:3]] == pytest.approx([math.sqrt(k / m)] * 3)
    ratio = c / (2 * math.sqrt(k * m))
    assert ratio > 1.0 and [mode.damping_ratio for mode in modes[:3]] == pytest.approx([ratio] * 3)
    assert {moving(linearised(system_of(SYMMETRIC)), mode) for mode in modes[:3]} == {
        ("X",), ("Y",), ("Z",)
    }  # fmt: skip


def test_a_free_deck_floats_and_its_turning_disc_nutates() -> None:
    raw = {**SYMMETRIC.as_mapping(), "mounts": []}
    still = vibration_of(made(raw))
    for mode in still.modes:
        assert mode.frequency == 0.0 and mode.damping_ratio is None
        assert mode.eigenvalues == (0.0, 0.0)
    names = {moving(still.linearised, mode)[0] for mode in still.modes}
    assert names == {*still.linearised.coordinates}
    w = 400.0
    *others, nutation = vibration_of(made(raw), w).modes
    assert all(mode.frequency == 0.0 for mode in others)
    ring = 4 * 5e-5 * 0.03**2 + 0.03 * 1e-5**2
    J_p, J_t = 1.35e-5 + ring, 1.29e-4 + 4 * 5e-5 * 0.01**2 + ring / 2
    assert nutation.frequency == pytest.approx(J_p * w / J_t, rel=1e-12)
    assert nutation.sense == "forward" and nutation.damping_ratio == pytest.approx(0.0, abs=1e-12)


def test_a_deck_held_along_the_shaft_only() -> None:
    raw = SYMMETRIC.as_mapping()
    for mount in raw["mounts"]:
        mount["stiffness"] = [0.0, 0.0, 1063.1]
    found = vibration_of(made(raw)).modes
    assert [mode.frequency == 0.0 for mode in found] == [True] * 3 + [False] * 3
    for mode in found[:3]:
        slow, fast = mode.eigenvalues
        assert slow == 0.0 and fast.real < -1.0 and mode.damping_ratio is None


def test_a_deck_that_falls_has_no_modes() -> None:
    raw = {**SYMMETRIC.as_mapping(), "mounts": []}
    with pytest.raises(SceneError, match="effects.gravity: no place"):
        vibration_of(made(raw, {"effects": {"gravity": {"tilt": 0.0}}}))


@pytest.mark.parametrize("name", scene_names())
def test_every_scene(name: str) -> None:
    scene = load_scene(name)
    vibration = vibration_of(scene, scene.spindle.max_speed)
    report = json.loads(json.dumps(vibration.report(), allow_nan=False))
    size = 2 if scene.deck is None else 6
    assert len(report["modes"]) == len(report["coordinates"]) == len(report["units"]) == size
    assert len(report["over_speed"]["branches"]) == size
    for mode in vibration.modes:
        assert mode.frequency > 0.0 and mode.damping_ratio is not None
        assert 0.0 < mode.damping_ratio < 0.5 and mode.growth < 0.0
    last = [branch["frequency"][-1] for branch in report["over_speed"]["branches"]]
    assert sorted(last) == pytest.approx([mode["frequency"] for mode in report["modes"]])
