"""A deck in space: its mounts are fitted one by one, and keys that cannot be are refused."""

from pathlib import Path
from typing import Any

import pytest

import ab_sim
from ab_sim.analysis.comparison import without_balls
from ab_sim.base.errors import InputError
from ab_sim.identification.files import Files, read_files
from ab_sim.identification.knowledge import knowledge_of
from ab_sim.identification.parameters import fitted_parameters
from ab_sim.identification.problem import Problem
from ab_sim.identification.residuals import noises_of
from ab_sim.identification.result import FITS
from ab_sim.scene.load import changed_scene

STIFFNESS, DAMPING = (1220.0, 960.0, 1120.0, 1010.0), (0.78, 0.48, 0.66, 0.54)
CORNERS = ((-0.06, -0.06), (-0.06, 0.06), (0.06, -0.06), (0.06, 0.06))
UP = {"profile": {"kind": "start_up", "acceleration": 180.0, "target_speed": 400.0}}


def deck(mounts: list[dict[str, Any]], **more: Any) -> ab_sim.Scene:
    """Without balls, run up through its critical speeds."""
    bare = without_balls(ab_sim.load_scene("couple-unbalance"))
    return changed_scene(bare, {**UP, "duration": 2.5, "mounts": mounts, **more}, "test")


def mounts(stiffness: tuple[float, ...], damping: tuple[float, ...]) -> list[dict[str, Any]]:
    """At the corners of the deck."""
    return [
        {"position": [x, y, 0.0], "stiffness": k, "damping": c}
        for (x, y), k, c in zip(CORNERS, stiffness, damping, strict=True)
    ]


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """By an accelerometer near a corner, which feels how the deck tilts."""
    pickup = {"position": [0.05, 0.04, 0.0], "noise_density": 1e-3, "bandwidth": 400.0}
    drive = deck(mounts(STIFFNESS, DAMPING), sensors={"corner": pickup})
    file = tmp_path_factory.mktemp("space") / "corner.rrd"
    ab_sim.save_recording(ab_sim.simulate(drive), file)
    return file


def test_four_mounts_are_told_apart(recording: Path) -> None:
    true = {f"mounts.{i}.stiffness": k for i, k in enumerate(STIFFNESS)}
    true["mounts.2.damping"] = DAMPING[2]
    begin = deck(mounts((1060.0,) * 4, (*DAMPING[:2], 0.5, DAMPING[3])))
    found = ab_sim.identify(recording, begin, list(true), propose=False)
    assert found.verdict == FITS
    for name, value in true.items():
        half = 0.8 * (found[name].high - found[name].low)
        assert abs(found[name].value - value) < half < 0.2 * value, name
    assert found.scene.mounts[3].stiffness == found["mounts.3.stiffness"].value


def test_places_that_nothing_tells_are_named_and_held(recording: Path) -> None:
    keys = [f"mounts.{i}.position.{axis}" for i in range(4) for axis in (0, 1)]
    scene = deck(mounts(STIFFNESS, DAMPING))
    measured, _ = read_files(Files([recording], [], [], [], None, (), {}), scene)
    common = fitted_parameters(scene, keys, {})
    own = Problem(scene, common, measured, noises_of(measured))
    found = knowledge_of(own, own.start)
    assert len(found.open) >= 2 and len(found.held) == len(found.open)
    for each in found.open:
        assert each.held in keys and "may change together" in each.words


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("mounts.4.damping", "4 entries, mounts.0 to mounts.3"),
        ("mounts.0.stiffness.2", "mounts.0.stiffness is one number"),
        ("mounts.1.stiffness", "fit one of mounts.1.stiffness.0, mounts.1."),
        ("mounts.0", "fit one of mounts.0.position, mounts.0.stiffness, mounts.0.damping"),
        ("mounts.0.position.2", "begins at 0, .* --bounds"),
        ("mounts.0.stifness", "mounts.0 has no stifness; .* stiffness"),
        ("effects.viscous_drag", "fit one of effects.viscous_drag.coefficient"),
    ],
)
def test_keys_that_are_no_number_are_refused(key: str, said: str) -> None:
    own = mounts(STIFFNESS, DAMPING)
    own[1]["stiffness"] = [1000.0, 1000.0, 2000.0]
    scene = changed_scene(ab_sim.load_scene("couple-unbalance"), {"mounts": own}, "test")
    with pytest.raises(InputError, match=said):
        fitted_parameters(scene, [key], {})


def test_one_of_three_stiffnesses_is_a_parameter() -> None:
    own = mounts(STIFFNESS, DAMPING)
    own[1]["stiffness"] = [1000.0, 1000.0, 2000.0]
    (found,) = fitted_parameters(deck(own), ["mounts.1.stiffness.2"], {})
    assert (found.start, found.unit, found.least) == (2000.0, "N/m", 0.0)
    assert found.key == "mounts.1.stiffness.2"
    moved = changed_scene(deck(own), {found.key: 1500.0}, "test")
    assert moved.mounts[1].stiffness == (1000.0, 1000.0, 1500.0)


def test_a_deck_in_the_plane_has_no_mounts() -> None:
    with pytest.raises(InputError, match="scene has no mounts"):
        fitted_parameters(ab_sim.load_scene("no-ball"), ["mounts.0.stiffness"], {})
