"""Values inside lists are keys like any other: `balls.mass.1`, `mounts.0.stiffness.2`."""

from typing import Any

import pytest

import ab_sim
from ab_sim.design.differences import real_key
from ab_sim.design.draws import DrawnPoints
from ab_sim.design.tolerances import tolerance_of
from ab_sim.scene.keys import scene_keys
from ab_sim.scene.load import changed_scene

SEGMENTS = "[{to: 60, acceleration: 40}, {hold: 0.5}, {to: 90, acceleration: 40}]"
PROFILE = (f"profile={{kind: segments, segments: {SEGMENTS}}}", "start.speed=0", "duration=2")
CASES = (
    ("thesis-hold", (), "balls.mass.1", "2 g", 0.002, [0.001, 0.002]),
    ("thesis-hold", (), "balls.radius.0", "1 mm", 0.001, None),
    ("thesis-hold", (), "start.ball_angles.1", "90 deg", 1.5707963267948966, None),
    ("thesis-hold", (), "start.ball_rates.1", "3", 3.0, [0.0, 3.0]),
    ("feeding-deck", (), "mounts.0.stiffness", "900", 900.0, 900.0),
    ("feeding-deck", (), "mounts.3.stiffness.2", "900", 900.0, None),
    ("feeding-deck", (), "race.height.0", "1 mm", 0.001, [0.001]),
    ("no-ball", PROFILE, "profile.segments.2.to", "1200 rpm", 125.66370614359172, None),
    ("no-ball", PROFILE, "profile.segments.1.hold", "1", 1.0, None),
)


def at(scene: ab_sim.Scene, key: str) -> Any:
    here: Any = scene.as_mapping()
    for part in key.split("."):
        here = here[int(part)] if isinstance(here, list) else here[part]
    return here


@pytest.mark.parametrize(("name", "more", "key", "text", "value", "owner"), CASES)
def test_a_change_reaches_into_a_list(
    name: str, more: tuple[str, ...], key: str, text: str, value: float, owner: Any
) -> None:
    scene = ab_sim.load_scene(name, more)
    other = ab_sim.load_scene(name, [*more, f"{key}={text}"])
    assert at(other, key) == pytest.approx(value, rel=1e-15) != at_or_none(scene, key)
    if owner is not None:
        assert at(other, key.rpartition(".")[0] if isinstance(owner, list) else key) == owner
    assert changed_scene(scene, {key: at(other, key)}, "test") == other
    assert scene == ab_sim.load_scene(name, more)  # shares nothing with what changed


def at_or_none(scene: ab_sim.Scene, key: str) -> Any:
    try:
        return at(scene, key)
    except (KeyError, IndexError, TypeError):
        return None


@pytest.mark.parametrize(("name", "more", "key", "text", "value", "owner"), CASES)
def test_studies_take_it(
    name: str, more: tuple[str, ...], key: str, text: str, value: float, owner: Any
) -> None:
    scene = ab_sim.load_scene(name, more)
    points = DrawnPoints(scene, [tolerance_of(f"{key}=normal:{text},1%")], 2, 0)
    assert points.keys == (key,)
    assert points.at(0)[0] == pytest.approx(value, rel=0.06)
    swept = ab_sim.sweep(scene, {key: [text]}, ["peak_whirl_over_e"])
    assert swept[key].tolist() == pytest.approx([value], rel=1e-15)
    assert swept.outcomes.get("failed", 0) == 0, swept.table["failure"].to_pylist()
    assert at(swept.scene_of(0), key) == swept[key][0]
    if not key.startswith("race.height"):
        assert real_key(scene, key).unit == swept.unit(key)


def test_a_deviation_is_about_the_value_of_the_one_ball() -> None:
    scene = ab_sim.load_scene("thesis-hold", ["balls.mass=[0.001, 0.003]"])
    points = DrawnPoints(scene, [tolerance_of("balls.mass.1=1%")], 50, 0)
    assert all(0.0028 < points.at(run)[0] < 0.0032 for run in range(50))


def test_tune_takes_it() -> None:
    scene = ab_sim.load_scene("thesis-hold", ["duration=0.2"])
    tuned = ab_sim.tune(
        scene, {"balls.mass.1": "0.5 g..2 g"}, minimise="final_whirl_over_e", runs=32
    )
    assert 0.0005 <= tuned.values["balls.mass.1"] <= 0.002


def test_an_entry_has_the_row_of_its_list() -> None:
    (row,) = scene_keys("balls.mass.1")
    assert (row.key, row.unit, row.range) == ("balls.mass.N", "kg", "1e-12 to 1000")
    assert [row.key for row in scene_keys("balls.mass")] == ["balls.mass"]
    (row,) = scene_keys("mounts.0.stiffness.2")
    assert (row.key, row.unit, row.range) == ("mounts.N.stiffness.N", "N/m", "0 to 1e+12")
    assert not [row for row in scene_keys() if row.key.endswith(".N")]


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("thesis-hold", "balls.mass.2=1", "balls.mass has 2 entries, balls.mass.0 to balls.mass.1"),
        ("thesis-hold", "balls.mass.-1=1", "and no '-1'; name one of them"),
        ("thesis-hold", "balls.mass.x=1", "and no 'x'"),
        ("thesis-hold", "balls.mass.0.x=1", "balls.mass.0 is a value"),
        ("thesis-hold", "mounts.0.stiffness=1", "the scene gives no mounts; give the whole list"),
        ("no-ball", "balls.mass.0=1", "give the whole list, balls.mass=[...]"),
        ("feeding-deck", "mounts.7=", "mounts has 4 entries, mounts.0 to mounts.3, and no '7'"),
        (
            "feeding-deck",
            "mounts.0.damp=",
            "mounts.0 has no 'damp' to remove",
        ),
    ],
)
def test_what_no_list_has_is_refused(name: str, change: str, words: str) -> None:
    with pytest.raises(ab_sim.SceneError) as raised:
        ab_sim.load_scene(name, [change])
    assert words in str(raised.value)


def test_a_changed_count_says_how_long_the_list_is() -> None:
    changes = ["balls.mass.2=0.002", "balls.count=3", "start.ball_angles="]
    assert ab_sim.load_scene("thesis-hold", changes).balls.mass == (0.001, 0.001, 0.002)
    with pytest.raises(ab_sim.SceneError, match=r"balls\.mass has no entries"):
        ab_sim.load_scene("thesis-hold", ["balls.count=1000000000", "balls.mass.2=0.002"])


def test_an_entry_can_be_removed() -> None:
    assert len(ab_sim.load_scene("feeding-deck", ["mounts.1="]).mounts) == 3


def test_a_changed_section_says_how_long_its_lists_are() -> None:
    changes = ["balls={count: 4, mass: 4e-4, radius: 1e-3}", "balls.mass.3=0.003"]
    changes.append("start.ball_angles=")
    assert ab_sim.load_scene("thesis-hold", changes).balls.mass == (4e-4, 4e-4, 4e-4, 3e-3)
