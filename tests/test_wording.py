"""Docstrings, help texts and pages have no opening and no word of ``words.yaml``."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[1]
LIST = yaml.safe_load((ROOT / "tests" / "words.yaml").read_text(encoding="utf-8"))
WORDS = re.compile(rf"\b({'|'.join(f'{word}|{word.capitalize()}' for word in LIST['words'])})\b")
OPENINGS = re.compile(rf"({'|'.join(LIST['openings'])})\b")


def docstrings() -> Iterator[tuple[str, str]]:
    """Yield all docstrings, those of attributes and of commands' options included."""
    paths = [p for package in ("ab_sim", "ab_msgs_py") for p in (ROOT / package).rglob("*.py")]
    for path in paths:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
                if isinstance(text := node.value.value, str):
                    yield f"{path.relative_to(ROOT)}:{node.lineno}", text


def pages() -> Iterator[tuple[str, str]]:
    """Yield all pages, without code."""
    for path in [ROOT / "README.md", ROOT / "CHANGELOG.rst", *(ROOT / "docs").rglob("*.md")]:
        text = path.read_text(encoding="utf-8")
        yield str(path.relative_to(ROOT)), re.sub(r"```.*?```|`[^`]*`", "", text, flags=re.DOTALL)


def test_docstrings_begin_with_a_verb_or_a_noun() -> None:
    every = list(docstrings())
    assert len(every) > 5000
    assert [(place, text) for place, text in every if OPENINGS.match(text)] == []


def test_no_word_of_the_list_is_used() -> None:
    found = [
        (place, word, LIST["words"][word.lower()])
        for place, text in (*docstrings(), *pages())
        for word in WORDS.findall(" ".join(text.split()))
    ]
    assert found == []
