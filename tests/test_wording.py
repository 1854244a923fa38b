"""Docstrings, help texts, pages and locals have no opening, word and name of ``words.yaml``."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import yaml

from tests.trees import nodes

ROOT = Path(__file__).parents[1]
MODULES = [p for package in ("ab_sim", "ab_msgs_py") for p in (ROOT / package).rglob("*.py")]
LIST = yaml.safe_load((ROOT / "tests" / "words.yaml").read_text(encoding="utf-8"))
WORDS = re.compile(rf"\b({'|'.join(f'{word}|{word.capitalize()}' for word in LIST['words'])})\b")
OPENINGS = re.compile(rf"({'|'.join(LIST['openings'])})\b")


def docstrings() -> Iterator[tuple[str, str]]:
    """Yield all docstrings, those of attributes and of commands' options included."""
    for path in MODULES:
        for node in nodes(path):
            if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
                if isinstance(text := node.value.value, str):
                    yield f"{path.relative_to(ROOT)}:{node.lineno}", text


def pages() -> Iterator[tuple[str, str]]:
    """Yield all pages, without code."""
    for path in [ROOT / "README.md", ROOT / "CHANGELOG.rst", *(ROOT / "docs").rglob("*.md")]:
        text = path.read_text(encoding="utf-8")
        yield str(path.relative_to(ROOT)), re.sub(r"```.*?```|`[^`]*`", "", text, flags=re.DOTALL)


def locals_() -> Iterator[tuple[str, str]]:
    """Yield the names of arguments and local variables; ``left`` next to ``right`` is a side."""
    for path in MODULES:
        for scope in nodes(path):
            if isinstance(scope, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
                inner = list(ast.walk(scope))
                names = {node.arg for node in inner if isinstance(node, ast.arg)}
                names |= {
                    node.id
                    for node in inner
                    if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
                }
                names -= {"left"} if "right" in names else set()
                yield from ((f"{path.relative_to(ROOT)}:{scope.lineno}", name) for name in names)


def test_docstrings_begin_with_a_verb_or_a_noun() -> None:
    every = list(docstrings())
    assert len(every) > 5000
    assert [(place, text) for place, text in every if OPENINGS.match(text)] == []


def test_docstrings_have_sections_of_numpy_style() -> None:
    """Their form is checked by ruff."""
    of_google = re.compile(r"^\s*(Args|Returns|Raises|Yields|Attributes):$", re.MULTILINE)
    assert [place for place, text in docstrings() if of_google.search(text)] == []


def test_no_word_of_the_list_is_used() -> None:
    found = [
        (place, word, LIST["words"][word.lower()])
        for place, text in (*docstrings(), *pages())
        for word in WORDS.findall(" ".join(text.split()))
    ]
    assert found == []


def test_locals_are_named_after_what_they_hold() -> None:
    every = list(locals_())
    assert len(every) > 10_000
    unnamed = [(place, name, LIST["names"][name]) for place, name in every if name in LIST["names"]]
    assert unnamed == []


def test_errors_are_checked_by_key_and_value_and_not_by_their_prose() -> None:
    """A `match=` written in place has at most four words; quoted values and units are none."""
    patterns = {
        f"{path.relative_to(ROOT)}:{node.value.lineno}": "".join(
            part.value
            for part in ast.walk(node.value)
            if isinstance(part, ast.Constant) and isinstance(part.value, str)
        )
        for path in (ROOT / "tests").rglob("*.py")
        for node in nodes(path)
        if isinstance(node, ast.keyword) and node.arg == "match"
    }
    assert len(patterns) > 300
    words = re.compile(r"(?<!\S)[\^(]*[A-Za-z]{2,}[,.;:?!)\\]*(?!\S)")
    long = {at: text for at, text in patterns.items() if len(words.findall(text)) > 4}
    assert long == {}
