"""Expressions as LaTeX."""

import re
from collections.abc import Callable, Mapping, Sequence

from ab_sim.tracing.expression import Expression
from ab_sim.tracing.printed import Holds, Notation, PrintedText, Printer

GREEK = frozenset(
    "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau "
    "phi chi psi omega Gamma Delta Theta Lambda Sigma Phi Psi Omega".split()
)
_DOTS = ("", "dot", "ddot", "dddot")


def latex(
    x: Expression, symbol: Callable[[str], str] = str, named: Mapping[int, str] | None = None
) -> str:
    """An expression as formula.

    Args:
        x: not lowered: as it was written.
        symbol: LaTeX of an input's name; what each ball has gets an index i.
        named: by number of a node the LaTeX that stands for it.
    """
    return Printer(Latex(), symbol, named).text(x)


def latex_symbol(text: str, known: Mapping[str, str] | None = None) -> str:
    """LaTeX of a symbol in plain text: ``k_3``, ``theta'`` (by time), ``beta_b``, ``rest_speed``.

    Args:
        text: a letter, or a Greek letter's name, with an index and primes; else a word.
        known: LaTeX of some that are written otherwise, without index and primes, too.
    """
    known = known or {}
    if text in known:
        return known[text]
    if len(text) > 2 and text[0] == text[-1] == "|":
        return rf"\left|{latex_symbol(text[1:-1], known)}\right|"
    if (called := re.fullmatch(r"(\w+)\((.+)\)", text)) is not None:
        of = latex_symbol(called[2], known)
        return rf"\mathrm{{{called[1]}}}\left({of}\right)"
    base, index, primes = _parts(text, known)
    if base in known:
        base = known[base]
    elif base in GREEK:
        base = f"\\{base}"
    elif len(base) > 1:
        base = rf"\mathrm{{{base.replace('_', chr(92) + '_')}}}"
    if primes:
        base = rf"\{_DOTS[len(primes)]}{{{base}}}"
    if len(index) > 1 and not index.isdigit():
        index = rf"\mathrm{{{index}}}"
    return f"{base}_{{{index}}}" if index else base


def _parts(text: str, known: Mapping[str, str]) -> tuple[str, str, str]:
    """Base, index and primes. A word keeps what is behind a _, unless that is a number."""
    bare = text.rstrip("'")
    primes = text[len(bare) :]
    if (digits := re.fullmatch(r"([A-Za-z])(\d+)", bare)) is not None:
        return digits[1], digits[2], primes
    base, _, index = bare.rpartition("_")
    if base and (len(base) == 1 or base in GREEK or base in known or index.isdigit()):
        return base, index, primes
    return bare, "", primes


class Latex(Notation):
    """LaTeX's."""

    minus_leads = False

    def number(self, value: float) -> PrintedText:
        """A number that is not negative, and no short fraction."""
        text = f"{value:.12g}"
        if "e" not in text:
            return PrintedText(text, Holds.ATOM)
        digits, power = text.split("e")
        return PrintedText(rf"{digits} \cdot 10^{{{int(power)}}}", Holds.PRODUCT)

    def fraction(self, top: int, bottom: int) -> PrintedText:
        """A number that is a short fraction."""
        return PrintedText(rf"\frac{{{top}}}{{{bottom}}}", Holds.ATOM)

    def indexed(self, symbol: str, index: str) -> str:
        """A symbol of which there is one per ball."""
        own = re.fullmatch(r"(.*_\{[^{}]*(?:\{[^{}]*\})?)\}", symbol)
        return f"{symbol}_{{{index}}}" if own is None else f"{own[1]},{index}}}"

    def bracketed(self, text: str) -> str:
        """In brackets."""
        return rf"\left({text}\right)"

    def product(self, factors: Sequence[str], numbers: int) -> str:
        """Factors, of which the first so many are numbers."""
        text = factors[0]
        for at, factor in enumerate(factors[1:], 1):
            text += (r" \cdot " if at < numbers else r" \, ") + factor
        return text

    def quotient(self, above: PrintedText, below: PrintedText) -> PrintedText:
        """One over another."""
        return PrintedText(rf"\frac{{{above.text}}}{{{below.text}}}", Holds.ATOM)

    def power(self, base: PrintedText, by: int) -> PrintedText:
        """A whole power, 2 or more."""
        tight = base.holds == Holds.ATOM and not base.text.startswith(r"\frac")
        text = base.text if tight else self.bracketed(base.text)
        return PrintedText(f"{text}^{{{by}}}", Holds.POWER)

    def function(self, name: str, argument: PrintedText, power: int = 1) -> PrintedText:
        """``cos``, ``sin``, ``sqrt``, ``abs`` or another, to a power."""
        if name == "abs":
            return PrintedText(rf"\left|{argument.text}\right|", Holds.ATOM)
        if name == "sqrt":
            return PrintedText(rf"\sqrt{{{argument.text}}}", Holds.ATOM)
        head = f"\\{name}" if name in ("cos", "sin") else rf"\mathrm{{{_escaped(name)}}}"
        if power > 1:
            head += f"^{{{power}}}"
        if argument.holds == Holds.ATOM:
            return PrintedText(f"{head} {argument.text}", Holds.PRODUCT)
        return PrintedText(rf"{head}\left({argument.text}\right)", Holds.PRODUCT)

    def comparison(self, op: str, left: str, right: str) -> str:
        """``lt`` or ``le``."""
        return f"{left} {'<' if op == 'lt' else chr(92) + 'le'} {right}"

    def choice(self, condition: str, then: PrintedText, other: PrintedText) -> PrintedText:
        """One if a condition holds, else another."""
        cases = rf"{then.text} & {condition} \\ {other.text} & \text{{else}}"
        return PrintedText(rf"\begin{{cases}} {cases} \end{{cases}}", Holds.ATOM)

    def total(self, term: str, index: str) -> PrintedText:
        """The sum over the balls of a product."""
        return PrintedText(rf"\sum_{index} {term}", Holds.OPEN)

    def row(self, term: str, index: str, over: str) -> PrintedText:
        """The sum over the balls of a row's element times a product."""
        return PrintedText(rf"\sum_{over} B_{{{index}{over}}} \, {term}", Holds.OPEN)


def _escaped(word: str) -> str:
    return word.replace("_", r"\_")
