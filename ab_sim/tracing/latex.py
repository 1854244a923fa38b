"""Expressions as LaTeX."""

from collections.abc import Callable

from ab_sim.tracing.expression import Expression

_SUM, _PRODUCT, _POWER, _ATOM = range(4)
"""How tightly what is written holds together."""


def latex(x: Expression, symbol: Callable[[str], str] = str) -> str:
    """An expression as formula.

    Args:
        x: not lowered: as it was written.
        symbol: LaTeX of an input's name; what each ball has gets an index i.
    """
    return _written(x, symbol)[0]


def _written(x: Expression, symbol: Callable[[str], str]) -> tuple[str, int]:
    """Text and how tightly it holds."""
    if x.op == "const":
        return _number(x.payload), _ATOM if x.payload >= 0 else _SUM
    if x.op == "input":
        return symbol(x.payload) + ("_{i}" if x.each else ""), _ATOM
    own = [_written(arg, symbol) for arg in x.args]

    def tight(k: int, least: int) -> str:
        text, holds = own[k]
        return text if holds >= least else rf"\left({text}\right)"

    if x.op == "add":
        return f"{tight(0, _SUM)} + {tight(1, _SUM)}".replace("+ -", "- "), _SUM
    if x.op == "sub":
        return f"{tight(0, _SUM)} - {tight(1, _PRODUCT)}", _SUM
    if x.op == "mul":
        if x.args[0] is x.args[1]:
            return f"{tight(0, _ATOM)}^{{2}}", _POWER
        # A number comes first.
        first, second = (1, 0) if x.args[1].op == "const" else (0, 1)
        times = r" \cdot " if x.args[second].op == "const" else r" \, "
        return f"{tight(first, _PRODUCT)}{times}{tight(second, _PRODUCT)}", _PRODUCT
    if x.op == "div":
        return rf"\frac{{{own[0][0]}}}{{{own[1][0]}}}", _ATOM
    if x.op == "neg":
        return f"-{tight(0, _PRODUCT)}", _SUM
    if x.op == "fma":
        return f"{tight(0, _PRODUCT)} \\, {tight(1, _PRODUCT)} + {tight(2, _SUM)}", _SUM
    if x.op in ("lt", "le"):
        return f"{own[0][0]} {'<' if x.op == 'lt' else chr(92) + 'le'} {own[1][0]}", _SUM
    if x.op == "where":
        cases = rf"{own[1][0]} & {own[0][0]} \\ {own[2][0]} & \text{{else}}"
        return rf"\begin{{cases}} {cases} \end{{cases}}", _ATOM
    if x.op == "abs":
        return rf"\left|{own[0][0]}\right|", _ATOM
    if x.op == "sqrt":
        return rf"\sqrt{{{own[0][0]}}}", _ATOM
    if x.op == "total":
        return rf"\sum_i {tight(0, _PRODUCT)}", _PRODUCT
    if x.op == "rows":
        return rf"\sum_j B_{{ij}} \, {tight(0, _PRODUCT)}".replace("_{i}", "_{j}"), _PRODUCT
    return rf"\{x.op} {tight(0, _ATOM)}", _PRODUCT


def _number(value: float) -> str:
    text = f"{value:.12g}"
    if "e" not in text:
        return text
    digits, power = text.split("e")
    return rf"{digits} \cdot 10^{{{int(power)}}}"
