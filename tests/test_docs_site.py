"""Documentation site: it builds without warnings, is complete, and agrees with the code."""

import html
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
from ab_sim.scene.registry import effect_classes

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
EXAMPLES = sorted((DOCS / "gallery" / "examples").glob("*.py"))


class Links(HTMLParser):
    """Parser that collects the files that a page of the site needs or links to."""

    def __init__(self) -> None:
        super().__init__()
        self.found: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name in ("href", "src") and value:
                self.found.add(value)


class Words(HTMLParser):
    """Parser that collects the text of a page without code."""

    def __init__(self) -> None:
        super().__init__()
        self.found = ""
        self._within: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag in ("code", "pre", "script", "style", "title"):
            self._within.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if self._within and tag == self._within[-1]:
            self._within.pop()

    def handle_data(self, data: str) -> None:
        if not self._within:
            self.found += data


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the documentation as `make docs` does, with warnings as errors."""
    for package in ("sphinx", "myst_parser", "sphinx_design", "sphinx_gallery", "furo"):
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
    """The site has all files that its pages load or link to, and so can be moved to a server."""
    for page in site.rglob("*.html"):
        links = Links()
        links.feed(page.read_text(encoding="utf-8"))
        for link in links.found:
            parts = urlsplit(link)
            if parts.scheme in ("http", "https", "data", "mailto") or not parts.path:
                continue
            target = (page.parent / unquote(parts.path)).resolve()
            assert target.is_relative_to(site) and target.exists(), f"{page}: {link}"
        loaded = re.findall(
            r"<(?:script|link|img)[^>]*(?:src|href)=\"(https?://[^\"]+)", page.read_text()
        )
        assert loaded == [], page


def names(page: Path) -> str:
    """Return a page in which names are in one piece: in tables they may wrap."""
    return page.read_text(encoding="utf-8").replace("<wbr>", "")


def test_the_site_has_what_follows_from_the_code(site: Path) -> None:
    keys = names(site / "reference/scene.html")
    for section in ("rotor", "race", "balls", "start", "spindle", "solver", "accuracy", "deck"):
        model = type(load_scene("everything")).model_fields[section].annotation
        (model,) = [
            m for m in (model, *getattr(model, "__args__", ())) if hasattr(m, "model_fields")
        ]
        for name in model.model_fields:
            assert f"{section}.{name}<" in keys
    commands = names(site / "reference/commands.html")
    for name in get_command(app).commands:
        assert f"ab-sim {name}<" in commands
    assert "effects.motor.torque_limit<" in names(site / "reference/effects.html")
    assert "command_age_limit<" in names(site / "reference/nodes.html")
    assert not any("to here" in page.read_text() for page in site.rglob("*.html"))


def test_a_newcomers_words_are_in_the_index_of_the_search(site: Path) -> None:
    index = (site / "searchindex.js").read_text(encoding="utf-8")
    for title in ("What is W/e?", "What does -180 deg mean?", "Is a speed in rpm or rad/s?"):
        assert title in index
    assert "Which of M0 e and M e is the unbalance?" in index


@pytest.mark.parametrize("script", EXAMPLES, ids=[script.stem for script in EXAMPLES])
def test_an_example_has_run_and_has_its_picture(script: Path, site: Path) -> None:
    assert re.fullmatch(r"plot_\d_\w+\.py", script.name)  # sphinx-gallery runs these, in this order
    page = (site / f"examples/{script.stem}.html").read_text(encoding="utf-8")
    assert f'src="../_images/sphx_glr_{script.stem}_001.png"' in page
    (download,) = re.findall(rf'href="\.\./(_downloads/\w+/{script.stem}\.py)"', page)
    assert (site / download).read_bytes() == script.read_bytes()
    gallery = (site / "gallery/index.html").read_text(encoding="utf-8")
    assert f"examples/{script.stem}.html" in gallery
    assert f"sphx_glr_{script.stem}_thumb.png" in gallery


@pytest.mark.parametrize("script", EXAMPLES, ids=[script.stem for script in EXAMPLES])
def test_an_example_is_short_and_needs_no_private_module(script: Path) -> None:
    text = script.read_text(encoding="utf-8")
    _, title, words, code = re.fullmatch(
        r'(""")\n(.+)\n=+\n\n(.*?)"""\n(.*)', text, re.DOTALL
    ).groups()
    assert 1 <= words.count(". ") + words.count(".\n") <= 3, title
    assert len([line for line in code.splitlines() if line.strip()]) <= 30
    assert set(re.findall(r"ab_sim\.\w+ import|import ab_sim\.\w+", code)) <= {
        "ab_sim.tracing import"
    }


def test_names_wrap_options_stay_whole_and_pictures_link_to_their_files(site: Path) -> None:
    page = (site / "reference/effects.html").read_text(encoding="utf-8")
    assert "effects.<wbr>motor.<wbr>torque_<wbr>limit<" in page
    commands = (site / "reference/commands.html").read_text(encoding="utf-8")
    assert '<span class="pre flag">--set</span>' in commands
    pages = [page.read_text(encoding="utf-8") for page in site.rglob("*.html")]
    sources = re.findall(r'<img\b[^>]*?src="([^"]*_images/[^"]+)"', "".join(pages))
    linked = re.findall(r'<a class="picture" href="([^"]+)"><img\b', "".join(pages))
    thumbnails = [source for source in sources if "_thumb" in source]
    assert len(linked) > 40
    assert len(linked) + len(thumbnails) == len(sources)


def test_python_has_no_types_of_pydantic(site: Path) -> None:
    page = (site / "reference/python.html").read_text(encoding="utf-8")
    assert "Annotated[" not in page and "object at 0x" not in page and "model_config" not in page
    assert 'href="../equations.html"' in page  # docstrings name it as docs/equations.md


def test_formulas_are_typeset(site: Path) -> None:
    for page in site.rglob("*.html"):
        words = Words()
        words.feed(page.read_text(encoding="utf-8"))
        assert re.findall(r"\\[A-Za-z]+|\$[^$\n]+\$", words.found) == [], page
    assert (site / "equations.html").read_text().count("<math ") > 100


def test_the_equation_of_each_effect_is_typeset(site: Path) -> None:
    page = (site / "reference/effects.html").read_text(encoding="utf-8")
    for name, effect in effect_classes().items():
        assert html.escape(effect.equation) not in page, f"{name}: docs/extensions/laws.py lacks it"


def test_no_page_scrolls_sideways_or_is_cut_off(site: Path) -> None:
    """Check the screens of a telephone and of a desktop computer."""
    pytest.importorskip("playwright", reason="needs a browser")
    from tests.viewing.browser import browser

    pages = sorted(site.rglob("*.html"))
    with browser(draws=False) as screen:
        found = {}
        for page in pages:
            screen.open(page.as_uri())
            for width in (390, 1280):
                screen.resize(width, 844)
                found[width, str(page.relative_to(site))] = screen.cut_off(), screen.sideways()
    assert len(pages) > 40
    assert {page: it for page, it in found.items() if it[0] or it[1] > 0} == {}
