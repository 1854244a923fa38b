"""Files from templates, and text from outside as it may stand in them."""

import re
from collections.abc import Mapping
from importlib.resources import files
from textwrap import wrap

from ab_sim.quoting import visible

TEMPLATES = files("ab_sim.c_code") / "template_files"
WIDTH = 96
"""Of lines of comments."""


def filled(name: str, values: Mapping[str, str], flags: Mapping[str, bool]) -> str:
    """A template with its values in place.

    Lines between ``@if FLAG`` and ``@end`` are left out where the flag is not set; ``@NAME@`` is
    a value, which may be of several lines.
    """
    lines, keep = [], True
    for line in (TEMPLATES / name).read_text(encoding="utf-8").splitlines():
        if line.startswith("@if "):
            keep = flags[line.removeprefix("@if ")]
        elif line == "@end":
            keep = True
        elif keep:
            lines.append(line)
    text = "\n".join(lines) + "\n"
    text = re.sub(r"^@([A-Z_]+)@\n", lambda found: _block(values[found[1]]), text, flags=re.M)
    text = re.sub(r"@([A-Z_]+)@", lambda found: values[found[1]], text)
    return re.sub(r"\n{3,}", "\n\n", text)


def _block(value: str) -> str:
    """What stands on lines of its own, with the end of the last one."""
    return value if value.endswith("\n") or not value else f"{value}\n"


def comment(*paragraphs: str) -> str:
    """Lines within a comment."""
    lines = [line for text in paragraphs for line in wrap(plain(text), WIDTH)]
    return "".join(f" * {line}\n" for line in lines)


def plain(text: str) -> str:
    """Text from outside, such that it ends no comment."""
    return visible(" ".join(text.split())).replace("*/", "* /").replace("/*", "/ *")
