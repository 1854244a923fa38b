"""Fit pages to narrow windows.

Long names in tables and headings may wrap, names of options may not. Pictures link to their files.
"""

import re
from typing import Any

from sphinx.application import Sphinx

_NAMES = re.compile(r"<(td|h[1-4])\b.*?</\1>", re.DOTALL)
_TEXT = re.compile(r">[^<]+")
_LONG = re.compile(r"[\w./,=|]{13,}")
_BREAK = re.compile(r"(?<=[a-z\d][./_,=|])(?<!\bab_)(?=[a-z])", re.IGNORECASE)
_LINK_OR_PICTURE = re.compile(r'<a\b.*?</a>|<img\b[^>]*?src="([^"]+)"[^>]*>', re.DOTALL)


def breakable(body: str) -> str:
    """Let names in table cells and headings wrap after dots, slashes and the like."""

    def wrapping(match: re.Match[str]) -> str:
        return _TEXT.sub(lambda text: _LONG.sub(word, text[0]), match[0])

    def word(match: re.Match[str]) -> str:
        return _BREAK.sub("<wbr>", match[0])

    return _NAMES.sub(wrapping, body)


def whole_options(body: str) -> str:
    """Mark names of options, which browsers would break after a hyphen."""
    return re.sub(r'<span class="pre">(?=-[^<]{1,24}<)', '<span class="pre flag">', body)


def enlargeable(body: str) -> str:
    """Link each picture outside a link to its file, and leave those of cards alone."""

    def link(match: re.Match[str]) -> str:
        picture, source = match[0], match[1]
        if source is None or "sd-card" in picture or "_thumb" in source:
            return picture
        return f'<a class="picture" href="{source}">{picture}</a>'

    return _LINK_OR_PICTURE.sub(link, body)


def fit(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    """Change the body of a page."""
    if "body" in context:
        context["body"] = enlargeable(whole_options(breakable(context["body"])))


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect to Sphinx."""
    app.connect("html-page-context", fit)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
