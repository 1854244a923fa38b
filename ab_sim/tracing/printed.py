"""Printing of expressions, common to all notations: order of factors, signs and brackets.

A ``Notation`` (``latex``, ``plain_text``) turns single operations into text; this module decides
which operations are printed together and which operands need brackets.
"""

import sys
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from enum import IntEnum
from fractions import Fraction
from types import FrameType
from typing import Any, NamedTuple, TypeVar

from ab_sim.tracing.expression import Expression


class Holds(IntEnum):
    """Binding strength of a printed text, from the weakest to the strongest."""

    CHOICE = 0
    SUM = 1
    OPEN = 2
    """Product that ends with an operator, such as a sum sign, that would act on factors after it;
    such a product may only be the last factor of another one."""
    PRODUCT = 3
    POWER = 4
    ATOM = 5


class PrintedText(NamedTuple):
    """Printed expression, and how strongly its outermost operator binds."""

    text: str
    holds: Holds


class Notation(ABC):
    """Rules that turn single operations into text."""

    minus_leads: bool
    """True if the minus of a quotient stands before the quotient, false if in the numerator."""

    @abstractmethod
    def number(self, value: float) -> PrintedText:
        """Return a number that is neither negative nor a short fraction."""

    @abstractmethod
    def fraction(self, top: int, bottom: int) -> PrintedText:
        """Return the number top/bottom, which has few digits."""

    @abstractmethod
    def indexed(self, symbol: str, index: str) -> str:
        """Return a symbol with the index of a ball."""

    @abstractmethod
    def bracketed(self, text: str) -> str:
        """Return a text in brackets."""

    @abstractmethod
    def product(self, factors: Sequence[str], numbers: int) -> str:
        """Return a product, whose first ``numbers`` factors are numbers."""

    @abstractmethod
    def quotient(self, above: PrintedText, below: PrintedText) -> PrintedText:
        """Return a fraction, with numerator ``above`` and denominator ``below``."""

    @abstractmethod
    def power(self, base: PrintedText, by: int) -> PrintedText:
        """Return the power of a base; the exponent is a whole number, 2 or more."""

    @abstractmethod
    def function(self, name: str, argument: PrintedText, power: int = 1) -> PrintedText:
        """Return the text of a function (``cos``, ``sqrt`` or another), raised to a power."""

    @abstractmethod
    def comparison(self, op: str, left: str, right: str) -> str:
        """Return the text of left < right (``lt``) or left <= right (``le``)."""

    @abstractmethod
    def choice(self, condition: str, then: PrintedText, other: PrintedText) -> PrintedText:
        """Return the text of ``then`` if a condition holds, else ``other``."""

    @abstractmethod
    def total(self, term: str, index: str) -> PrintedText:
        """Return the sum of a term over the balls, which ``index`` counts."""

    @abstractmethod
    def row(self, term: str, index: str, over: str) -> PrintedText:
        """Return a row of a matrix product: the sum of B[index, over] * term over all ``over``."""

    def tight(self, it: PrintedText, least: Holds) -> str:
        """Return an expression's text, in brackets if it binds less strongly than ``least``."""
        return it.text if it.holds >= least else self.bracketed(it.text)


class Printer:
    """Printer of expressions as they were written, before lowering.

    Parameters
    ----------
    notation
        Rules that turn single operations into text.
    symbol
        Function that returns the symbol of an input's name.
    named
        Symbols to print instead of nodes, by the nodes' numbers.
    """

    def __init__(
        self,
        notation: Notation,
        symbol: Callable[[str], str] = str,
        named: Mapping[int, str] | None = None,
    ) -> None:
        self._notation, self._symbol, self._named = notation, symbol, named or {}

    def text(self, x: Expression) -> str:
        """Return the text of an expression, written out even if its node has a symbol."""
        return self._written(x, "i", whole=True).text

    def name(self, x: Expression) -> str:
        """Return the symbol of a node that has one."""
        return self._symbol_of(x, self._named[x.number], "i")

    def _symbol_of(self, x: Expression, symbol: str, index: str) -> str:
        """Return a node's symbol, with an index if it stands for one number per ball."""
        return self._notation.indexed(symbol, index) if x.each else symbol

    def _written(self, x: Expression, index: str, whole: bool = False) -> PrintedText:
        """Return the text of a node; with ``whole``, written out even if the node has a symbol."""
        if x.number in self._named and not whole:
            return PrintedText(self._symbol_of(x, self._named[x.number], index), Holds.ATOM)
        terms = self._terms(x, index)
        if len(terms) == 1 and not terms[0][0]:
            return terms[0][1]
        # After a minus, a sum needs brackets: a - (b + c).
        text = ""
        for minus, term in terms:
            body = self._notation.tight(term, Holds.OPEN if minus else Holds.SUM)
            text += (" - " if minus else " + ") + body
        return PrintedText("-" + text[3:] if terms[0][0] else text[3:], Holds.SUM)

    def _terms(self, x: Expression, index: str) -> list[tuple[bool, PrintedText]]:
        """Return a sum's terms, each with True if subtracted; a node that is no sum is one term."""
        if x.op in ("add", "sub", "fma"):
            if x.op == "fma":
                first = [(False, self._product([x.args[0], x.args[1]], index)[1])]
            else:
                first = self._part(x.args[0], index)
            last = self._part(x.args[-1], index)
            if x.op == "sub":
                last = self._flipped(x.args[-1], last, index)
            return [*first, *last]
        if x.op == "neg":
            return self._flipped(x.args[0], self._part(x.args[0], index), index)
        if x.op == "const":
            return [(x.payload < 0, self._number(abs(x.payload)))]
        if x.op == "mul":
            return [self._product([x], index)]
        if x.op == "total":
            return [self._total(x.args[0], index)]
        if x.op == "div" and self._notation.minus_leads:
            above = self._part(x.args[0], index)
            if len(above) == 1:
                below = self._written(x.args[1], index)
                return [(above[0][0], self._notation.quotient(above[0][1], below))]
        return [(False, self._other(x, index))]

    def _part(self, x: Expression, index: str) -> list[tuple[bool, PrintedText]]:
        """Return the terms of a node within a sum; a node with a symbol is one term."""
        if x.number in self._named:
            return [(False, self._written(x, index))]
        return self._terms(x, index)

    def _flipped(
        self, x: Expression, terms: list[tuple[bool, PrintedText]], index: str
    ) -> list[tuple[bool, PrintedText]]:
        """Return the negative of terms: a single term's sign changes, several become one term."""
        if len(terms) == 1:
            return [(not terms[0][0], terms[0][1])]
        return [(True, self._written(x, index))]

    def _total(self, x: Expression, index: str) -> tuple[bool, PrintedText]:
        """Return a sum over the balls; the sign of a single term is moved before the sum."""
        terms = self._part(x, index)
        minus, term = terms[0] if len(terms) == 1 else (False, self._written(x, index))
        return minus, self._notation.total(self._notation.tight(term, Holds.OPEN), index)

    def _product(self, parts: Sequence[Expression], index: str) -> tuple[bool, PrintedText]:
        """Return whether a product is negative, and its absolute value as text.

        Nested products are flattened: constants, repeated factors (powers) and factors 1/x are
        collected, so that the product is one fraction.
        """
        minus, numbers, factors, below = False, [], Counter[Expression](), Counter[Expression]()
        ahead = list(parts)
        outermost = parts[0] if len(parts) == 1 else None
        while ahead:
            x = ahead.pop(0)
            plain = x is outermost or x.number not in self._named
            if plain and x.op == "mul":
                ahead[:0] = x.args
            elif plain and x.op == "const":
                minus ^= x.payload < 0
                numbers.append(self._number(abs(x.payload)))
            elif plain and x.op == "div" and x.args[0].op == "const" and x.args[0].payload == 1:
                below[x.args[1]] += 1
            else:
                factors[x] += 1
        above = self._joined(numbers, factors, index)
        if below:
            above = self._notation.quotient(above, self._joined([], below, index))
        return minus, above

    def _joined(
        self, numbers: Sequence[PrintedText], factors: Mapping[Expression, int], index: str
    ) -> PrintedText:
        """Return a product: numbers first, then plain factors, then functions and sums."""
        factors_in_order = [(self._late(x), self._factor(x, n, index)) for x, n in factors.items()]
        parts = [*numbers, *(it for _, it in sorted(factors_in_order, key=lambda item: item[0]))]
        if not parts:
            return self._number(1.0)
        if len(parts) == 1:
            return parts[0]
        least = [Holds.PRODUCT] * (len(parts) - 1) + [Holds.OPEN]
        if numbers:
            least[0] = Holds.OPEN
        texts = [self._notation.tight(it, hold) for it, hold in zip(parts, least, strict=True)]
        holds = Holds.OPEN if parts[-1].holds == Holds.OPEN else Holds.PRODUCT
        return PrintedText(self._notation.product(texts, len(numbers)), holds)

    def _late(self, x: Expression) -> int:
        """Return a factor's rank in a product: functions come late, sums last.

        A sum takes in all factors that follow it.
        """
        if x.number in self._named:
            return 0
        return {"cos": 1, "sin": 1, "div": 2, "total": 3, "rows": 3}.get(x.op, 0)

    def _factor(self, x: Expression, count: int, index: str) -> PrintedText:
        """Return a factor of a product, to the power ``count``."""
        if x.op in ("cos", "sin") and x.number not in self._named:
            return self._notation.function(x.op, self._written(x.args[0], index), count)
        it = self._written(x, index)
        return it if count == 1 else self._notation.power(it, count)

    def _number(self, value: float) -> PrintedText:
        """Return a nonnegative number as text, as a short fraction if the number equals one."""
        short = Fraction(value).limit_denominator(9) if value < 100 else Fraction(1)
        if short.denominator > 1 and short.numerator / short.denominator == value:
            return self._notation.fraction(short.numerator, short.denominator)
        return self._notation.number(value)

    def _other(self, x: Expression, index: str) -> PrintedText:
        """Return the text of an operation that is neither a sum nor a product."""
        notation = self._notation
        if x.op == "input":
            return PrintedText(self._symbol_of(x, self._symbol(x.payload), index), Holds.ATOM)
        if x.op == "rows":
            over = chr(ord(index) + 1)
            term = notation.tight(self._written(x.args[0], over), Holds.OPEN)
            return notation.row(term, index, over)
        operands = [self._written(arg, index) for arg in x.args]
        if x.op == "div":
            return notation.quotient(operands[0], operands[1])
        if x.op == "where":
            return notation.choice(operands[0].text, operands[1], operands[2])
        if x.op in ("lt", "le"):
            return PrintedText(
                notation.comparison(x.op, operands[0].text, operands[1].text), Holds.CHOICE
            )
        return notation.function(x.op, operands[0])


T = TypeVar("T")

_PACKAGE = __name__.rpartition(".")[0]
"""Name of this package, in whose functions local variables are no quantities of a formula."""


class Named(NamedTuple):
    """Intermediate quantity of a formula, with the name of its variable in the source code."""

    name: str
    """Name of the local variable in the source code."""
    node: Expression
    """Expression of the quantity."""


def with_local_names(formula: Callable[..., T], *arguments: Any) -> tuple[T, list[Named]]:
    """Return a formula's result, and the named quantities in it and in the formulas that it calls.

    Parameters
    ----------
    formula
        Plain Python on numbers.
    *arguments
        Expressions, or nested tuples of them.

    Returns
    -------
    tuple[T, list[Named]]
        The result, and each node that was the value of a local variable when a function returned,
        or of a field of a named tuple that was constructed, in the order of the nodes' creation.
        Inputs and constants are left out; of several nodes with one name, the first is returned.
    """
    by_name: dict[str, Named] = {}

    def look(frame: FrameType, event: str, _: Any) -> None:
        if event != "return" or frame.f_globals.get("__name__", "").startswith(_PACKAGE):
            return
        for name, value in frame.f_locals.items():
            if isinstance(value, Expression) and value.op not in ("input", "const"):
                by_name.setdefault(name, Named(name, value))

    before = sys.getprofile()
    sys.setprofile(look)
    try:
        result = formula(*arguments)
    finally:
        sys.setprofile(before)
    return result, sorted(by_name.values(), key=lambda one: one.node.number)
