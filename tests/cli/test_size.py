"""`ab-sim size` as its users run it."""

import json
from pathlib import Path

import pytest

import ab_sim as package
from ab_sim.design.sizing.specification import MOST_BALLS
from tests.cli.tool import PNG, ab_sim, refused

DRIVE = (
    "--mass", "100 g", "--critical", "100 rad/s", "--speed", "200 rad/s", "--race-radius", "12 mm",
    "--race-width", "4 mm",
)  # fmt: skip
OF = ("--unbalance", "0.3 g cm")


def test_it_is_shown_drawn_and_written(tmp_path: Path) -> None:
    done = ab_sim(
        "size", *DRIVE, *OF, "--balls", "5", "--runs", "60", "--scene", "sized.yaml",
        "--plot", "size.png", "--json", "size.json", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "take 5 balls of 0.0597" in done.stdout and "no hold" in done.stdout
    report = json.loads((tmp_path / "size.json").read_text())
    assert report["found"] and all(each["claim"] for each in report["claims"])
    assert package.load_scene(tmp_path / "sized.yaml").as_mapping() == report["scene"]
    assert (tmp_path / "size.png").read_bytes().startswith(PNG)


def test_the_largest_number_of_balls_is_stated_in_help_page_and_refusal() -> None:
    assert f"must be FROM..TO or a number, from 2 to {MOST_BALLS};" in refused(
        "size", *DRIVE, *OF, "--balls", f"{MOST_BALLS}..{MOST_BALLS + 1}"
    )
    assert f"from 2 to {MOST_BALLS}." in " ".join(ab_sim("size", "--help").stdout.split())
    page = Path(package.__file__).parents[1] / "docs" / "howto" / "size.md"
    assert f"at most {MOST_BALLS} balls;" in page.read_text(encoding="utf-8")


def test_where_nothing_can_be_sized_it_says_why(tmp_path: Path) -> None:
    done = ab_sim(
        "size", *DRIVE, *OF, "--balls", "2", "--settle", "0.5 s", "--scene", "s.yaml", cwd=tmp_path
    )
    assert done.returncode == 1 and not list(tmp_path.glob("*.yaml"))
    assert "2 balls: at no drag 90 %" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "unbalance, grade: give one of them"),
        ((*OF, "--speed", "50 rad/s"), "must be above critical"),
        ((*OF, "--mass", "3 mm"), "is a length"),
        ((*OF, "--share", "most"), "--share 'most': must be a share, e.g. 10%"),
        ((*OF, "--share", "120%"), "share = 1.2: must be from"),
        ((*OF, "--runs", "1"), "runs = 1: must be from 20"),
        ((*OF, "--scene", "s.txt"), "must end in"),
        ((*OF, "--workers", "0"), "must be at least 1"),
    ],
)
def test_bad_input_exits_with_2(arguments: tuple[str, ...], words: str, tmp_path: Path) -> None:
    assert words in refused("size", *DRIVE, *arguments, cwd=tmp_path)
