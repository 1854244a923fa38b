"""Formulas as MathML, which browsers typeset by themselves: no script, no font, no network.

docutils, which Sphinx is made of, converts LaTeX; nothing else is installed for it.
"""

import re
from collections.abc import Callable
from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging

logger = logging.getLogger(__name__)

_DOTTED = re.compile(r"\\d{1,3}ot\{(?:[^{}]|\{[^{}]*\})*\}")
_APPLIED = re.compile(r"<mo>&ApplyFunction;</mo>(?!\s*(?:<mrow>\s*)?<mo[^>]*>\()")


def mathml(latex: str, *, block: bool, where: Any = None) -> str:
    """A formula as MathML; one that cannot be converted is a warning, which stops the build."""
    # In brackets, that an index stands behind the letter with its dot, not below it.
    grouped = _DOTTED.sub(r"{\g<0>{}}", latex)
    try:
        made = tex2mathml(grouped, as_block=block)
    except MathError as error:
        logger.warning("formula %r: %s", latex, error, location=where)
        return ""
    # As accents dots touch the letter, but for few fonts; and "cos x" is no word.
    made = made.replace('<mover accent="true">', "<mover>")
    return _APPLIED.sub('<mspace width="0.1667em"/>', made)


def _renderer(block: bool) -> tuple[Callable[[Any, Any], None], None]:
    def visit(writer: Any, node: Any) -> None:
        made = mathml(node.astext(), block=block, where=node)
        writer.body.append(f'<div class="formula">{made}</div>\n' if block else made)
        raise nodes.SkipNode

    return visit, None


def setup(app: Sphinx) -> dict[str, bool]:
    """As Sphinx calls it."""
    app.add_html_math_renderer("mathml", _renderer(False), _renderer(True))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
