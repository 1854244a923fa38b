"""Notations of printed expressions: LaTeX, and plain text for a terminal or a code block."""

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
    """Return an expression as a LaTeX formula.

    Parameters
    ----------
    x
        Expression that is not lowered, so that it is printed as written.
    symbol
        Function that returns the LaTeX of an input's name; quantities per ball get an index i.
    named
        LaTeX symbols to print instead of nodes, by the nodes' numbers.
    """
    return Printer(Latex(), symbol, named).text(x)


def latex_symbol(text: str, known_symbols: Mapping[str, str] | None = None) -> str:
    """Return the LaTeX of a symbol in plain text: ``k_3``, ``theta'``, ``beta_b``, ``rest_speed``.

    Primes are derivatives with respect to time, and become dots.

    Parameters
    ----------
    text
        A letter or the name of a Greek letter, with an index and primes; or a word.
    known_symbols
        LaTeX of symbols that differ from these rules; a key without index and primes applies to the
        base of a symbol.
    """
    known_symbols = known_symbols or {}
    if text in known_symbols:
        return known_symbols[text]
    if len(text) > 2 and text[0] == text[-1] == "|":
        return rf"\left|{latex_symbol(text[1:-1], known_symbols)}\right|"
    if (called := re.fullmatch(r"(\w+)\((.+)\)", text)) is not None:
        of = latex_symbol(called[2], known_symbols)
        return rf"\mathrm{{{called[1]}}}\left({of}\right)"
    base, index, primes = _parts(text, known_symbols)
    if base in known_symbols:
        base = known_symbols[base]
    elif base in GREEK:
        base = f"\\{base}"
    elif len(base) > 1:
        base = rf"\mathrm{{{base.replace('_', chr(92) + '_')}}}"
    if primes:
        base = rf"\{_DOTS[len(primes)]}{{{base}}}"
    if len(index) > 1 and not index.isdigit():
        index = rf"\mathrm{{{index}}}"
    return f"{base}_{{{index}}}" if index else base


def _parts(text: str, known_symbols: Mapping[str, str]) -> tuple[str, str, str]:
    """Return base, index and primes; in a word, only a number after ``_`` is an index."""
    bare = text.rstrip("'")
    primes = text[len(bare) :]
    if (digits := re.fullmatch(r"([A-Za-z])(\d+)", bare)) is not None:
        return digits[1], digits[2], primes
    base, _, index = bare.rpartition("_")
    if base and (len(base) == 1 or base in GREEK or base in known_symbols or index.isdigit()):
        return base, index, primes
    return bare, "", primes


class Latex(Notation):
    """Notation of LaTeX."""

    minus_leads = False

    def number(self, value: float) -> PrintedText:
        """Return the LaTeX of a number that is neither negative nor a short fraction."""
        text = f"{value:.12g}"
        if "e" not in text:
            return PrintedText(text, Holds.ATOM)
        digits, power = text.split("e")
        return PrintedText(rf"{digits} \cdot 10^{{{int(power)}}}", Holds.PRODUCT)

    def fraction(self, top: int, bottom: int) -> PrintedText:
        """Return the number top/bottom, which has few digits."""
        return PrintedText(rf"\frac{{{top}}}{{{bottom}}}", Holds.ATOM)

    def indexed(self, symbol: str, index: str) -> str:
        """Return a symbol with the index of a ball."""
        match = re.fullmatch(r"(.*_\{[^{}]*(?:\{[^{}]*\})?)\}", symbol)
        return f"{symbol}_{{{index}}}" if match is None else f"{match[1]},{index}}}"

    def bracketed(self, text: str) -> str:
        """Return a text in brackets."""
        return rf"\left({text}\right)"

    def product(self, factors: Sequence[str], numbers: int) -> str:
        """Return a product, whose first ``numbers`` factors are numbers."""
        text = factors[0]
        for at, factor in enumerate(factors[1:], 1):
            text += (r" \cdot " if at < numbers else r" \, ") + factor
        return text

    def quotient(self, above: PrintedText, below: PrintedText) -> PrintedText:
        """Return a fraction, with numerator ``above`` and denominator ``below``."""
        return PrintedText(rf"\frac{{{above.text}}}{{{below.text}}}", Holds.ATOM)

    def power(self, base: PrintedText, by: int) -> PrintedText:
        """Return the power of a base; the exponent is a whole number, 2 or more."""
        tight = base.holds == Holds.ATOM and not base.text.startswith(r"\frac")
        text = base.text if tight else self.bracketed(base.text)
        return PrintedText(f"{text}^{{{by}}}", Holds.POWER)

    def function(self, name: str, argument: PrintedText, power: int = 1) -> PrintedText:
        """Return the text of a function (``cos``, ``sqrt`` or another), raised to a power."""
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
        """Return the text of left < right (``lt``) or left <= right (``le``)."""
        return f"{left} {'<' if op == 'lt' else chr(92) + 'le'} {right}"

    def choice(self, condition: str, then: PrintedText, other: PrintedText) -> PrintedText:
        """Return the text of ``then`` if a condition holds, else ``other``."""
        cases = rf"{then.text} & {condition} \\ {other.text} & \text{{else}}"
        return PrintedText(rf"\begin{{cases}} {cases} \end{{cases}}", Holds.ATOM)

    def total(self, term: str, index: str) -> PrintedText:
        """Return the sum of a term over the balls, which ``index`` counts."""
        return PrintedText(rf"\sum_{index} {term}", Holds.OPEN)

    def row(self, term: str, index: str, over: str) -> PrintedText:
        """Return a row of a matrix product: the sum of B[index, over] * term over all ``over``."""
        return PrintedText(rf"\sum_{over} B_{{{index}{over}}} \, {term}", Holds.OPEN)


def _escaped(word: str) -> str:
    """Return a word with its underscores escaped for LaTeX."""
    return word.replace("_", r"\_")


def plain_text(
    x: Expression, symbol: Callable[[str], str] = str, named: Mapping[int, str] | None = None
) -> str:
    """Return an expression as text: factors stand side by side, powers have a ``^``.

    Parameters
    ----------
    x
        Expression that is not lowered, so that it is printed as written.
    symbol
        Function that returns the text of an input's name; quantities per ball get an index i.
    named
        Symbols to print instead of nodes, by the nodes' numbers.
    """
    return Printer(PlainText(), symbol, named).text(x)


class PlainText(Notation):
    """Notation of plain text."""

    minus_leads = True

    def number(self, value: float) -> PrintedText:
        """Return a number that is neither negative nor a short fraction."""
        return PrintedText(f"{value:.12g}", Holds.ATOM)

    def fraction(self, top: int, bottom: int) -> PrintedText:
        """Return the number top/bottom, which has few digits."""
        return PrintedText(f"{top}/{bottom}", Holds.OPEN)

    def indexed(self, symbol: str, index: str) -> str:
        """Return a symbol with the index of a ball, which stands before primes."""
        bare = symbol.rstrip("'")
        return f"{bare}{',' if '_' in bare else '_'}{index}{symbol[len(bare) :]}"

    def bracketed(self, text: str) -> str:
        """Return a text in brackets."""
        return f"({text})"

    def product(self, factors: Sequence[str], numbers: int) -> str:
        """Return a product, whose first ``numbers`` factors are numbers."""
        apart = max(numbers - 1, 0)
        return " * ".join([*factors[:apart], " ".join(factors[apart:])])

    def quotient(self, above: PrintedText, below: PrintedText) -> PrintedText:
        """Return a fraction, with numerator ``above`` and denominator ``below``."""
        top, bottom = self.tight(above, Holds.PRODUCT), self.tight(below, Holds.POWER)
        return PrintedText(f"{top}/{bottom}", Holds.OPEN)

    def power(self, base: PrintedText, by: int) -> PrintedText:
        """Return the power of a base; the exponent is a whole number, 2 or more."""
        return PrintedText(f"{self.tight(base, Holds.ATOM)}^{by}", Holds.POWER)

    def function(self, name: str, argument: PrintedText, power: int = 1) -> PrintedText:
        """Return the text of a function (``cos``, ``sqrt`` or another), raised to a power."""
        text = f"|{argument.text}|" if name == "abs" else f"{name}({argument.text})"
        it = PrintedText(text, Holds.ATOM)
        return it if power == 1 else self.power(it, power)

    def comparison(self, op: str, left: str, right: str) -> str:
        """Return the text of left < right (``lt``) or left <= right (``le``)."""
        return f"{left} {'<' if op == 'lt' else '<='} {right}"

    def choice(self, condition: str, then: PrintedText, other: PrintedText) -> PrintedText:
        """Return the text of ``then`` if a condition holds, else ``other``."""
        return PrintedText(
            f"{self.tight(then, Holds.SUM)} if {condition}, else {other.text}", Holds.CHOICE
        )

    def total(self, term: str, index: str) -> PrintedText:
        """Return the sum of a term over the balls, which ``index`` counts."""
        return PrintedText(f"sum_{index} {term}", Holds.OPEN)

    def row(self, term: str, index: str, over: str) -> PrintedText:
        """Return a row of a matrix product: the sum of B[index, over] * term over all ``over``."""
        return PrintedText(f"sum_{over} B_{index}{over} {term}", Holds.OPEN)
