"""Links from a page to files that are no pages of the site.

Pages name such files relative to themselves, as GitHub wants it. The site has a page for each text
in ``GUIDES`` and copies of other files, which MyST makes. It has no folders: their path follows
the words of the link.
"""

import os
import re
from pathlib import Path

from sphinx.application import Sphinx

ROOT = Path(__file__).absolute().parents[2]
GUIDES = {
    "CHANGELOG.rst": "docs/changelog.rst",
    "CONTRIBUTING.md": "docs/contributing.md",
    "examples/firmware_prototype/README.md": "docs/howto/firmware-prototype.md",
    "examples/firmware_in_lock_step/README.md": "docs/howto/firmware-in-lock-step.md",
    "examples/firmware_in_c/README.md": "docs/howto/firmware-in-c.md",
}
"""Texts outside of docs, and the pages that include them."""
_GUIDE = re.compile(r"^<!-- guide -->\n.*?^<!-- to here -->$", re.DOTALL | re.MULTILINE)
_PLAIN = re.compile(r"(?<![\w(\[/`])docs/([\w/-]+\.md)")
_LINK = re.compile(r"\[([^]]*)\]\((?![a-z]+:|#)([^)#\s]+)((?:#[^)\s]*)?)\)")


def relinked(text: str, old: Path, new: Path) -> str:
    """Return the text of the file ``old`` with the links that it needs in the page ``new``."""

    def link(match: re.Match[str]) -> str:
        words, path, fragment = match.groups()
        target = Path(os.path.normpath(old.parent / path))
        if target.is_dir():
            name = f"{target.relative_to(ROOT)}/"
            return f"`{name}`" if words in name else f"{words} (`{name}`)"
        page = GUIDES.get(os.path.relpath(target, ROOT))
        target = ROOT / page if page else target
        return f"[{words}]({os.path.relpath(target, new.parent)}{fragment})"

    return _LINK.sub(link, text)


def include(app: Sphinx, docname: str, source: list[str]) -> None:
    """Put the text of a page's guide, without its title, into the page; change the page's links.

    Names of pages, such as docs/topics.md, become links.
    """
    page = Path(app.env.doc2path(docname)).absolute()
    if page.suffix != ".md":
        return
    up = os.path.relpath(app.srcdir, page.parent)
    text = relinked(_PLAIN.sub(rf"[docs/\1]({up}/\1)", source[0]), page, page)
    guide = {ROOT / place: ROOT / name for name, place in GUIDES.items()}.get(page)
    if guide:
        _, _, body = guide.read_text(encoding="utf-8").partition("\n")
        text = _GUIDE.sub(lambda _: relinked(body, guide, page), text)
    source[0] = text


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect to Sphinx, after other parts have been filled in."""
    app.connect("source-read", include)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
