"""The documentation site: it is built without a warning, is whole, and has what the code says."""

import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from typer.main import get_command

from ab_sim.cli.app import app
from ab_sim.scene import load_scene

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"


class Links(HTMLParser):
    """Files that a page of the site needs or leads to."""

    def __init__(self) -> None:
        super().__init__()
        self.found: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name in ("href", "src") and value:
                self.found.add(value)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The documentation as `make docs` builds it: a warning is an error."""
    for package in ("sphinx", "myst_parser", "sphinx_design", "furo"):
        pytest.importorskip(package, reason="the site needs ab_sim[docs], for Python 3.11 or newer")
    folder = tmp_path_factory.mktemp("site")
    options = ("-W", "--keep-going", "--quiet", "-b", "html", "-d", f"{folder}/.doctrees")
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", *options, str(DOCS), str(folder)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    return folder


def test_the_site_is_whole(site: Path) -> None:
    """It needs no network and no server: all that its pages load lies in it, and links end."""
    for page in site.rglob("*.html"):
        links = Links()
        links.feed(page.read_text(encoding="utf-8"))
        for link in links.found:
            parts = urlsplit(link)
            if parts.scheme in ("http", "https", "data", "mailto") or not parts.path:
                continue
            assert (page.parent / unquote(parts.path)).exists(), f"{page}: {link}"
        loaded = re.findall(
            r"<(?:script|link|img)[^>]*(?:src|href)=\"(https?://[^\"]+)", page.read_text()
        )
        assert loaded == [], page


def test_the_site_has_what_follows_from_the_code(site: Path) -> None:
    keys = (site / "reference/scene.html").read_text(encoding="utf-8")
    for section in ("rotor", "race", "balls", "start", "spindle", "solver", "accuracy", "deck"):
        model = type(load_scene("everything")).model_fields[section].annotation
        (model,) = [
            m for m in (model, *getattr(model, "__args__", ())) if hasattr(m, "model_fields")
        ]
        for name in model.model_fields:
            assert f"{section}.{name}<" in keys
    commands = (site / "reference/commands.html").read_text(encoding="utf-8")
    for name in get_command(app).commands:
        assert f"ab-sim {name}<" in commands
    assert "effects.motor.torque_limit<" in (site / "reference/effects.html").read_text()
    assert "command_age_limit<" in (site / "reference/nodes.html").read_text()
    assert not any("to here" in page.read_text() for page in site.rglob("*.html"))


def test_a_newcomers_words_are_in_the_index_of_the_search(site: Path) -> None:
    index = (site / "searchindex.js").read_text(encoding="utf-8")
    for title in ("What is W/e?", "What does -180 deg mean?", "Is a speed in rpm or rad/s?"):
        assert title in index
    assert "Which of M0 e and M e is the unbalance?" in index
