"""Scenes of a deck in space: what is wrong is told once, clearly, and what has no meaning there."""

from typing import Any

import numpy as np
import pytest

from ab_sim.base.errors import SceneError
from ab_sim.drive import Drive
from ab_sim.scene import Scene, check_scene, load_scene, scene_names
from tests.conftest import THESIS, merge
from tests.deck.scenes import ODD, odd

NAN = float("nan")
FIRST = ODD["mounts"][0]
RUBBER: dict[str, Any] = {"stiffness": 1000.0, "damping": 0.2}
UNEQUAL = {"stiffness_1": 1.0, "stiffness_2": 1.0, "damping_1": 0.0, "damping_2": 0.0}
CONTACT: dict[str, Any] = {"ball_contact": {"restitution_coefficient": 0.5}}


def mount(**changes: Any) -> dict[str, Any]:
    return {"mounts": [FIRST, merge(FIRST, changes)]}


def start(**deck: Any) -> dict[str, Any]:
    return {"start": {"deck": deck}}


BAD: list[tuple[dict[str, Any], str]] = [
    # deck and rotor
    ({"deck": {"inertia": None}}, "deck.inertia: is missing; add it;"),
    ({"deck": {"inertia": 3.0}}, "deck.inertia = 3.0: must be a list;"),
    ({"deck": {"inertia": [1, 2]}}, "deck.inertia = [1, 2]: has 2 numbers; give [xx, yy, zz], or"),
    ({"deck": {"inertia": [1, 1, 1, 0]}}, "deck.inertia = [1, 1, 1, 0]: has 4 numbers; give [xx"),
    ({"deck": {"inertia": [1, 1, "x"]}}, "deck.inertia.2 = 'x': must be a number, in kg m^2 or"),
    ({"deck": {"inertia": [1, 1, NAN]}}, "deck.inertia.2 = nan: must be a finite number;"),
    (
        {"deck": {"inertia": [1e-4, 1e-4, 3e-4]}},
        "deck.inertia = [0.0001, 0.0001, 0.0003] kg m^2: no rigid body has it; the principal "
        "moments are 0.0001, 0.0001, 0.0003: none may be negative, or larger than the sum of the "
        "two others",
    ),
    ({"deck": {"inertia": [1, 1, 1, 2, 0, 0]}}, "deck.inertia = [1.0, 1.0, 1.0, 2.0, 0.0, 0.0] kg"),
    ({"deck": {"inertia": [0, 0, 0]}}, "deck.inertia = [0.0, 0.0, 0.0] kg m^2: no rigid body"),
    ({"deck": {"center": [0, 0]}}, "deck.center.2: is missing; add it;"),
    ({"deck": {"center": [0, 0, 11]}}, "deck.center.2 = 11: must be at most 10;"),
    ({"deck": {"mass": 1.0}}, "deck.mass = 1.0: not known here"),
    ({"rotor": {"inertia": None}}, "rotor.inertia: is needed, the scene has a deck in space (deck"),
    ({"rotor": {"inertia": [1, -1, 1]}}, "rotor.inertia = [1.0, -1.0, 1.0] kg m^2: no rigid"),
    ({"rotor": {"inertia": [1]}}, "rotor.inertia = [1]: has 1 numbers; give [xx, yy, zz], or"),
    (
        {"rotor": {"eccentric_mass": None}},
        "rotor.eccentric_mass: is needed, the scene has a deck in space (deck): the mass of rotor "
        "and disc, whose centre is off the shaft axis by rotor.eccentricity",
    ),
    ({"rotor": {"height": -11}}, "rotor.height = -11: must be at least -10;"),
    # mounts
    ({"mounts": 3}, "mounts = 3: must be a list"),
    (mount(position=None), "mounts.1.position: is missing; add it;"),
    (mount(position=[0, 0, 0, 0]), "mounts.1.position = [0, 0, 0, 0]: has 4 entries, must be 3;"),
    (mount(stiffness=-1), "mounts.1.stiffness = -1: must be at least 0;"),
    (mount(stiffness=[1, 2]), "mounts.1.stiffness: has 2 numbers; give one, or one for each of it"),
    (mount(stiffness=[1, 2, -3]), "mounts.1.stiffness.2 = -3: must be at least 0;"),
    (mount(damping=[1] * 4), "mounts.1.damping: has 4 numbers; give one, or one for each of its"),
    (mount(damping=None), "mounts.1.damping: is missing; add it;"),
    (mount(turned=[0, 0, NAN]), "mounts.1.turned.2 = nan: must be a finite number;"),
    (mount(stiffnes=1.0), "mounts.1.stiffnes = 1.0: not known here; did you mean 'stiffness'?"),
    # races
    ({"race": {"height": []}}, "race.height = []: give one number, or one for each race"),
    ({"race": {"height": "low"}}, "race.height = 'low': must be a number, in m or with a unit"),
    ({"balls": {"race": [0, 2]}}, "balls.race.1 = 2: there is no such race; race.height has 2, co"),
    ({"balls": {"race": -1}}, "balls.race = -1: there is no such race; race.height has 2, counted"),
    ({"balls": {"race": [0, 0.5]}}, "balls.race.1 = 0.5: must be a whole number;"),
    ({"balls": {"race": [0]}}, "balls.race: has 1 races for 2 balls (balls.count); give one per"),
    # the start
    (start(position=[0, 0]), "start.deck.position = [0.0, 0.0]: has 2 numbers, and the deck moves "
        "along 3 axes"),
    (start(velocity=[0, 0]), "start.deck.velocity = [0.0, 0.0]: has 2 numbers, and the deck moves"),
    (start(velocity=3.0), "start.deck.velocity = 3.0: must be a list;"),
    (start(position=[0, 0, 11]), "start.deck.position.2 = 11: must be at most 10;"),
    (start(tilt=[0, 0]), "start.deck.tilt.2: is missing; add it;"),
    (start(tilt_rate=[0, 0, NAN]), "start.deck.tilt_rate.2 = nan: must be a finite number;"),
    (
        start(tilt=[1.5707963267948966, 0, 0]),
        "start.deck.tilt = [1.5707963267948966, 0.0, 0.0] rad: at alpha = +-pi/2 the angles beta "
        "and gamma turn about the same axis; tilt the deck a little less",
    ),
    (start(positon=[0, 0, 0]), "start.deck.positon = [0, 0, 0]: not known here; did you mean 'pos"),
    ({"start": {"ball_rates": [1.0]}}, "start.ball_rates: has 1 rates for 2 balls (balls.count); "),
    # what acts on a deck in the plane
    (
        {"effects": {"suspension": RUBBER}},
        "effects.suspension: acts on a deck in the plane only, and the scene has one in space; "
        "remove it; describe the springs as mounts",
    ),
    (
        {"effects": {"unequal_suspension": UNEQUAL}},
        "effects.unequal_suspension: acts on a deck in the plane only, and the scene has one in "
        "space; remove it; describe the springs as mounts",
    ),
    (
        {"effects": CONTACT},
        "effects.ball_contact: balls in more than one race (balls.race), where contacts are not "
        "modelled; put them into one race, or leave the effect out",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "words"), BAD, ids=[words[:40] for _, words in BAD])
def test_bad_input_of_a_deck_in_space_is_told_once(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError) as caught:
        odd("smooth", changes)
    (message,) = str(caught.value).splitlines()
    assert message.startswith(f"test: {words}"), message


IN_PLANE = (
    ": has no meaning for a deck that moves in the plane of the disc; remove it, or describe the "
    "deck in space (sections deck and mounts)"
)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"mounts": [FIRST]}, "mounts" + IN_PLANE),
        ({"rotor": {"height": 0.01}}, "rotor.height" + IN_PLANE),
        ({"rotor": {"inertia": [1.0, 1.0, 1.0]}}, "rotor.inertia" + IN_PLANE),
        ({"race": {"height": 0.01}}, "race.height" + IN_PLANE),
        ({"race": {"height": [0.0, 0.0]}}, "race.height" + IN_PLANE),
        ({"balls": {"race": 1}}, "balls.race" + IN_PLANE),
        (start(position=[0, 0, 0]), "start.deck.position = [0.0, 0.0, 0.0]: has 3 numbers, and the "
            "deck moves along 2 axes"),
        (start(velocity=[0.0]), "start.deck.velocity = [0.0]: has 1 numbers, and the deck moves"),
        (start(tilt=[0, 0, 0]), "start.deck.tilt: the deck moves in the plane of the disc and does "
            "not tilt; remove it, or describe the deck in space (sections deck and mounts)"),
        (start(tilt_rate=[0, 0, 0]), "start.deck.tilt_rate: the deck moves in the plane of the"),
    ],
)  # fmt: skip
def test_what_means_nothing_in_the_plane_is_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError) as caught:
        check_scene(merge(THESIS, changes), "test")
    (message,) = str(caught.value).splitlines()
    assert message.startswith(f"test: {words}"), message


def test_a_deck_in_space_reads_back() -> None:
    """What is kept with a recording is the same scene."""
    for scene in (odd("all"), load_scene("feeding-deck")):
        assert check_scene(scene.as_mapping(), "again") == scene


def test_the_eccentric_mass_may_be_the_whole_mass() -> None:
    """Mass at the deck's origin acts alike, whether it turns or not."""
    origin = ["rotor.eccentricity=0", "deck.center=[0, 0, 0]"]
    ends = [
        Drive(load_scene("feeding-deck", [*origin, f"rotor.eccentric_mass={mass}"])).advance(200)
        for mass in (0.03, 0.13)
    ]
    np.testing.assert_allclose(ends[1].ball_angles, ends[0].ball_angles, rtol=1e-12)


def test_a_raised_rotor_adds_to_its_couple_unbalance() -> None:
    flat, raised = (load_scene("couple-unbalance", [f"rotor.height={h}"]) for h in (0, 0.004))
    added = raised.couple_unbalance - flat.couple_unbalance
    assert abs(flat.couple_unbalance) == pytest.approx(4.5e-8, rel=1e-12)
    assert added == pytest.approx(0.03 * 1e-5 * 0.004, rel=1e-9)


def test_hardening_acts_on_both() -> None:
    springs = {"hardening_suspension": {"cubic_stiffness": 1e8}}
    assert isinstance(odd("smooth", {"effects": springs}), Scene)
    assert isinstance(check_scene(merge(THESIS, {"effects": springs}), "test"), Scene)


def test_a_deck_in_space_is_among_the_scenes() -> None:
    assert any(load_scene(name).deck is not None for name in scene_names())
