"""Links from a page to a file outside of docs lead into the checkout that the site was made from.

Pages name such files relative to themselves, as GitHub wants it. The site is somewhere else.
"""

import os
import re
from pathlib import Path

from sphinx.application import Sphinx

_LINK = re.compile(r"\]\((?![a-z]+:|#)([^)#\s]+)((?:#[^)\s]*)?)\)")


def lead_out(app: Sphinx, docname: str, source: list[str]) -> None:
    """Turn each link to a file that is no page into one from the page's place in the site."""
    docs = Path(app.srcdir).resolve()
    page = Path(app.env.doc2path(docname)).resolve().parent
    site = (Path(app.outdir).resolve() / docname).parent

    def led(link: re.Match[str]) -> str:
        target = (page / link[1]).resolve()
        inside = target.is_relative_to(docs)
        if not target.exists() or (inside and target.suffix in (".md", ".rst", ".png")):
            return link[0]
        return f"](source:{os.path.relpath(target, site)}{link[2]})"

    source[0] = _LINK.sub(led, source[0])


def setup(app: Sphinx) -> dict[str, bool]:
    """As Sphinx calls it."""
    app.connect("source-read", lead_out)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
