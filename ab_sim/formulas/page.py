"""The parts of docs/equations.md that are made from the code, between markers."""

import re
from collections.abc import Iterator

from ab_sim.formulas.effects import formulas_of
from ab_sim.formulas.lines import Lines
from ab_sim.formulas.planar import planar_sections
from ab_sim.scene.registry import effect_classes

PAGE = "docs/equations.md"
MAKE = "python benchmarks/equations_page.py"
"""What makes the parts anew."""


def page_from_code(page: str) -> str:
    """A page with its parts made anew.

    Raises:
        ValueError: a part has no place in it.
    """
    for name, made in (("planar", _planar()), ("effects", _effects())):
        begin, end = f"<!-- {name}: made by {MAKE} -->", f"<!-- {name}: end -->"
        pattern = re.escape(begin) + ".*?" + re.escape(end)
        if len(re.findall(pattern, page, re.DOTALL)) != 1:
            raise ValueError(f"{PAGE}: needs one place between {begin!r} and {end!r}")
        block = "\n".join([begin, "", *made, end])
        page = re.sub(pattern, lambda _, block=block: block, page, flags=re.DOTALL)  # type: ignore[misc]
    return page


def _planar() -> Iterator[str]:
    for title, lines in planar_sections():
        yield f"{title[0].upper()}{title[1:]}:"
        yield ""
        yield from (f"    {line}" for line in _texts(lines))
        yield ""


def _effects() -> Iterator[str]:
    for name, effect in effect_classes().items():
        formulas = formulas_of(effect)
        symbols = {}
        for formula in formulas:
            symbols.update(formula.parameters)
        named = ", ".join(f"{symbol} is `{field}`" for symbol, field in symbols.items())
        yield f"`{name}`" + (f": {named}" if named else "")
        yield ""
        width = max(len(formula.method) for formula in formulas)
        for formula in formulas:
            for k, line in enumerate(_texts(formula.lines)):
                yield f"    {formula.method if k == 0 else '':{width}}   {line}"
        yield ""


def _texts(lines: Lines) -> Iterator[str]:
    yield from (line.text for line in lines.equations)
    for k, line in enumerate(lines.quantities):
        yield f"  {'with' if k == 0 else '    '} {line.text}"
