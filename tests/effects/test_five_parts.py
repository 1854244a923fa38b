"""Every registered effect shows its five parts; one that does not fails the suite."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import pytest

import ab_sim
from ab_sim.scene.registry import effect_classes, register
from tests.effects.parts import PART_NAMES, FiveParts, Run, lacking, parts_of


@pytest.mark.parametrize("part", PART_NAMES)
@pytest.mark.parametrize("name", effect_classes())
def test_part(name: str, part: str) -> None:
    parts = parts_of(name)
    getattr(parts, part)()
    assert parts.witnessed > 0, "the part never looked whether the effect was active"


def test_every_registered_effect_has_its_five_parts() -> None:
    assert lacking(effect_classes()) == []


@pytest.fixture
def dummy() -> Iterator[str]:
    with ab_sim.temporary_registrations():

        @register("dummy", equation="0 = 0", source="this test")
        class Dummy(NamedTuple):
            """Nothing."""

        yield "dummy"


def test_an_effect_without_a_file_is_found(dummy: str) -> None:
    assert lacking(effect_classes()) == ["dummy: no file tests/effects/dummy.py"]


class Half(FiveParts):
    """Forgets direction and limit, and says nothing of activity."""

    name = "dummy"


class Whole(Half):
    """Has all of them."""

    def strength(self, run: Run) -> float:
        return 1.0

    def direction(self) -> None: ...

    def limit(self) -> None: ...


def test_missing_parts_are_found(dummy: str) -> None:
    found = lacking([dummy], lambda name: Half())
    assert found == ["dummy: activity", "dummy: direction", "dummy: limit"]
    assert lacking([dummy], lambda name: Whole()) == []
    assert lacking(["gravity"], lambda name: Whole()) == ["gravity: its file speaks of dummy"]


@pytest.mark.parametrize("part", ["rotation", "power"])
def test_a_part_that_is_taken_away_is_found(part: str, monkeypatch: Any) -> None:
    monkeypatch.delattr(FiveParts, part)
    assert lacking(["ball_spin"]) == [f"ball_spin: {part}"]


def test_an_idle_effect_is_not_active() -> None:
    """All parts stand on this: gravity that is switched off fails its own activity."""
    with pytest.raises(AssertionError, match="gravity was not active"):
        parts_of("gravity").watch({"effects": {"gravity": {"tilt": 0.0}}})
