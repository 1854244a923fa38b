"""Generate the parts of docs/equations.md that follow from the code, between markers."""

import re
from collections.abc import Iterator, Sequence

from ab_sim.export.formulas.effects import formulas_of
from ab_sim.export.formulas.lines import Line, Lines, in_latex
from ab_sim.export.formulas.planar import planar_sections
from ab_sim.scene.registry import effect_classes

PAGE = "docs/equations.md"
MAKE = "python benchmarks/equations_page.py"
"""Command that generates the parts."""
WIDE = 100
"""Length in characters above which an equation's two sides are printed on two lines."""


def page_from_code(page: str) -> str:
    """Return the text of a page with the parts between markers generated again.

    Raises
    ------
    ValueError
        The markers of a part are missing, or occur more than once.
    """
    for name, lines in (("planar", _planar()), ("effects", _effects())):
        begin, end = f"<!-- {name}: made by {MAKE} -->", f"<!-- {name}: end -->"
        pattern = re.escape(begin) + ".*?" + re.escape(end)
        if len(re.findall(pattern, page, re.DOTALL)) != 1:
            raise ValueError(f"{PAGE}: needs one place between {begin!r} and {end!r}")
        block = "\n".join([begin, "", *lines, end])
        page = re.sub(pattern, lambda _, block=block: block, page, flags=re.DOTALL)  # type: ignore[misc]
    return page


def typeset(lines: Lines) -> Iterator[str]:
    """Yield formulas as LaTeX in Markdown, in the syntax of GitHub and the documentation site."""
    yield from _aligned(lines.equations)
    if lines.quantities:
        yield from ["with", "", *_aligned(lines.quantities)]


def _planar() -> Iterator[str]:
    """Yield the lines of the part on a deck in the plane."""
    for title, lines in planar_sections():
        yield f"{title[0].upper()}{title[1:]}:"
        yield ""
        yield from typeset(lines)


def _effects() -> Iterator[str]:
    """Yield the lines of the part on effects: a heading, symbols and formulas of each."""
    for name, effect in effect_classes().items():
        formulas = formulas_of(effect)
        symbols = {}
        for formula in formulas:
            symbols.update(formula.parameters)
        named = ", ".join(f"${in_latex(symbol)}$ is `{field}`" for symbol, field in symbols.items())
        yield from [f"### {name}", ""]
        yield from [f"{named}.", ""] if named else []
        for formula in formulas:
            yield from [f"`{formula.method}`:", "", *typeset(formula.lines)]


def _aligned(lines: Sequence[Line]) -> Iterator[str]:
    """Yield equations as a LaTeX block, aligned at their equals signs."""
    wide = any(len(line.text) > WIDE for line in lines)
    rows = [row for line in lines for row in _rows(line.latex, wide)]
    yield from ["```math", r"\begin{aligned}"]
    yield from (rf"{row} \\" for row in rows[:-1])
    yield from [rows[-1], r"\end{aligned}", "```", ""]


def _rows(latex: str, wide: bool) -> list[str]:
    """Return the rows of an aligned equation: its two sides on two rows if ``wide``."""
    left_side, sign, right = latex.partition(" = ")
    if not sign:
        return [f"& {left_side}"] if wide else [left_side]
    return [f"& {left_side}", rf"& \quad = {right}"] if wide else [f"{left_side} &= {right}"]
