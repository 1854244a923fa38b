"""Filling of templates, and escaping of text that is not from ab_sim."""

import html
import re
from collections.abc import Mapping
from importlib.resources import files
from textwrap import wrap

from ab_sim.base.errors import visible

_TEMPLATES = files("ab_sim.export.c_code") / "template_files"
"""Folder of the templates."""
WIDTH = 96
"""Width of lines of comments."""


def filled(name: str, values: Mapping[str, str], flags: Mapping[str, bool]) -> str:
    """Return a template with its values filled in.

    Lines between ``@if FLAG`` and ``@end`` are left out if the flag is not set. ``@NAME@`` is
    replaced by a value, which may have several lines. All values are inserted in one pass, so that
    a name within a value is not replaced.

    Parameters
    ----------
    name
        File name of the template.
    values
        Values by their names.
    flags
        Flags by their names.
    """
    lines, keep = [], True
    for line in (_TEMPLATES / name).read_text(encoding="utf-8").splitlines():
        if line.startswith("@if "):
            keep = flags[line.removeprefix("@if ")]
        elif line == "@end":
            keep = True
        elif keep:
            lines.append(line)
    text = "\n".join(lines) + "\n"

    def value(match: re.Match[str]) -> str:
        block, word = match.groups()
        return values[word] if block is None else _block(values[block])

    text = re.sub(r"^@([A-Z_]+)@\n|@([A-Z_]+)@", value, text, flags=re.M)
    return re.sub(r"\n{3,}", "\n\n", text)


def _block(value: str) -> str:
    """Return a value that fills whole lines, with a final line end."""
    return value if value.endswith("\n") or not value else f"{value}\n"


def comment(*paragraphs: str) -> str:
    """Return paragraphs as wrapped lines within a C comment."""
    lines = [line for text in paragraphs for line in wrap(plain(text), WIDTH)]
    return "".join(f" * {line}\n" for line in lines)


def one_line(text: str) -> str:
    """Return untrusted text on one line, with control characters escaped."""
    return visible(" ".join(text.split()))


def plain(text: str) -> str:
    """Return untrusted text that cannot end a comment of C or CMake."""
    text = re.sub(r"\?(?=\?)", "? ", one_line(text))  # no trigraphs: ??/ would join lines
    return text.replace("*/", "* /").replace("/*", "/ *")


def in_html(text: str) -> str:
    """Escape ``&``, ``<`` and ``>`` in untrusted text for HTML and its comments."""
    return html.escape(one_line(text), quote=False)


def in_markdown(text: str) -> str:
    """Escape untrusted text for Markdown, so that it has no markup, HTML or links."""
    return re.sub(r"[]\\`*_[<>&|~#!$:@^=]", r"\\\g<0>", one_line(text))
