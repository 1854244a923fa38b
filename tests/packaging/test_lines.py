"""Lines are counted once each, and every file of the core has a purpose."""

import importlib.util
from pathlib import Path

ROOT = Path(__file__).parents[2]
spec = importlib.util.spec_from_file_location("lines", ROOT / "tools" / "lines.py")
assert spec and spec.loader
lines = importlib.util.module_from_spec(spec)
spec.loader.exec_module(lines)

TEXT = '''"""A docstring
of two lines."""

# A comment.
COUNT = 3  # code
"""A text behind a name."""


def of(
    x: str,
) -> str:
    """Its docstring."""
    return x + """
text that is computed with"""
'''


def test_a_line_is_one_of_four() -> None:
    assert lines.lines_of(TEXT) == lines.Lines(1, code=6, docstrings=4, comments=1, blank=3)
    assert lines.lines_of(TEXT).all == len(TEXT.splitlines())


def test_every_file_has_a_purpose() -> None:
    files = lines.here()
    found = lines.by_purpose(files, {each.name: each.new for each in lines.PURPOSES})
    assert lines.added([*found.values()]) == lines.added([*files.values()])
    assert min(each.code for each in found.values()) > 100
