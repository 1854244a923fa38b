"""Limits of YAML from outside: little text that stands for much, and much text."""

from pathlib import Path

import pytest

from ab_sim.base.errors import SceneError
from ab_sim.base.yaml_files import MOST_BYTES, MOST_LEVELS, MOST_VALUES, read_yaml, read_yaml_file
from ab_sim.scene import load_scene
from ab_sim.scene.explain import MOST_MESSAGES
from ab_sim.scene.load import load_profile

LINE = "&{0} [*{1}, *{1}, *{1}, *{1}, *{1}, *{1}, *{1}, *{1}, *{1}]"
BOMB = (
    "[&a [x, x, x], "
    + ", ".join(LINE.format(*pair) for pair in zip("bcdefghijk", "abcdefghij", strict=True))
    + "]"
)
"""Stands for 9^10 values."""


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (BOMB, f"has more than {MOST_VALUES} values, at line 1"),
        ("[" + "1," * MOST_VALUES + "]", f"has more than {MOST_VALUES} values"),
        ("[" * (MOST_LEVELS + 1), f"has more than {MOST_LEVELS} levels within each other"),
        ("x" * (MOST_BYTES + 1), f"has more than {MOST_BYTES} bytes"),
        ("9" * 5000, "has a number of more than 100 digits"),
        ("0x" + "f" * 5000, "has a number of more than 100 digits"),
        ("1:30", "1:30 would be a number in base 60; write it with a decimal point"),
        ("-1:30.5", "would be a number in base 60"),
        ("1:1" * 5000, "has a number of more than 100 digits"),
        ("&a [*a]", "*a refers to a node that contains it, at line 1, column 5"),
        ("!" + "x" * 5000, "could not determine a constructor"),
        ("!!bool foo", "a value is not of its kind ('foo')"),
        ("? [a]", "a value is not of its kind"),
    ],
)
def test_limits(text: str, words: str) -> None:
    with pytest.raises(ValueError) as refused:
        read_yaml(text)
    said = str(refused.value)
    assert words in said and len(said) < 500 and "\n" not in said


def test_a_number_is_what_it_reads_as() -> None:
    """YAML 1.1 has octal and base 60 where no unit or prefix says so."""
    assert read_yaml("[010, -007, 0_10, 0, 0x10, 010.5, 1_000]") == [10, -7, 10, 0, 16, 10.5, 1000]


def test_a_change_of_the_content_does_not_change_what_is_read_next() -> None:
    text = "effects: [gravity, {suspension: {stiffness: 1000.0}}]"
    read_yaml(text)["effects"].append("motor")
    assert read_yaml(text) == {"effects": ["gravity", {"suspension": {"stiffness": 1000.0}}]}


def test_within_the_limits() -> None:
    assert read_yaml("[" * MOST_LEVELS + "]" * MOST_LEVELS)
    assert read_yaml("{a: &a [1, 2], b: *a, c: [*a, *a]}") == {
        "a": [1, 2],
        "b": [1, 2],
        "c": [[1, 2], [1, 2]],
    }


def test_a_file_of_any_size_is_read_to_the_limit(tmp_path: Path) -> None:
    file = tmp_path / "sparse.yaml"
    with file.open("wb") as opened:
        opened.truncate(2**38)
    with pytest.raises(ValueError, match=f"has more than {MOST_BYTES} bytes"):
        read_yaml_file(file)


def test_scenes_profiles_and_changes_are_read_so(tmp_path: Path) -> None:
    file = tmp_path / "bomb.yaml"
    file.write_text(f"kind: {BOMB}")
    for refused in (
        lambda: load_scene(file),
        lambda: load_profile(str(file)),
        lambda: load_profile(f"{{kind: {BOMB}}}"),
        lambda: load_scene("no-ball", [f"start={BOMB}"]),
    ):
        with pytest.raises(SceneError, match="has more than 50000 values") as caught:
            refused()
        assert len(str(caught.value)) < 1000


def test_errors_of_much_are_short(tmp_path: Path) -> None:
    """Values are quoted in short, and of many findings some are told."""
    file = tmp_path / "much.yaml"
    file.write_text(f"name: [{'long, ' * 5000}]\n" + "".join(f"k{n}: 1\n" for n in range(2000)))
    with pytest.raises(SceneError) as caught:
        load_scene(file)
    lines = str(caught.value).splitlines()
    assert len(lines) < MOST_MESSAGES + 5 and max(map(len, lines)) < 1000
    assert "findings in all" in lines[-1]
