"""Expressions as text that is read in a terminal or in a code block."""

from collections.abc import Callable, Mapping, Sequence

from ab_sim.tracing.expression import Expression
from ab_sim.tracing.printed import Holds, Notation, PrintedText, Printer


def plain_text(
    x: Expression, symbol: Callable[[str], str] = str, named: Mapping[int, str] | None = None
) -> str:
    """An expression as text: products are juxtaposed, powers have a ^.

    Args:
        x: not lowered: as it was written.
        symbol: text of an input's name; what each ball has gets an index i.
        named: by number of a node the text that stands for it.
    """
    return Printer(PlainText(), symbol, named).text(x)


class PlainText(Notation):
    """Plain text's."""

    minus_leads = True

    def number(self, value: float) -> PrintedText:
        """A number that is not negative, and no short fraction."""
        return PrintedText(f"{value:.12g}", Holds.ATOM)

    def fraction(self, top: int, bottom: int) -> PrintedText:
        """A number that is a short fraction."""
        return PrintedText(f"{top}/{bottom}", Holds.OPEN)

    def indexed(self, symbol: str, index: str) -> str:
        """A symbol of which there is one per ball: the index stands before primes."""
        bare = symbol.rstrip("'")
        return f"{bare}{',' if '_' in bare else '_'}{index}{symbol[len(bare) :]}"

    def bracketed(self, text: str) -> str:
        """In brackets."""
        return f"({text})"

    def product(self, factors: Sequence[str], numbers: int) -> str:
        """Factors, of which the first so many are numbers."""
        apart = max(numbers - 1, 0)
        return " * ".join([*factors[:apart], " ".join(factors[apart:])])

    def quotient(self, above: PrintedText, below: PrintedText) -> PrintedText:
        """One over another."""
        top, bottom = self.tight(above, Holds.PRODUCT), self.tight(below, Holds.POWER)
        return PrintedText(f"{top}/{bottom}", Holds.OPEN)

    def power(self, base: PrintedText, by: int) -> PrintedText:
        """A whole power, 2 or more."""
        return PrintedText(f"{self.tight(base, Holds.ATOM)}^{by}", Holds.POWER)

    def function(self, name: str, argument: PrintedText, power: int = 1) -> PrintedText:
        """``cos``, ``sin``, ``sqrt``, ``abs`` or another, to a power."""
        text = f"|{argument.text}|" if name == "abs" else f"{name}({argument.text})"
        it = PrintedText(text, Holds.ATOM)
        return it if power == 1 else self.power(it, power)

    def comparison(self, op: str, left: str, right: str) -> str:
        """``lt`` or ``le``."""
        return f"{left} {'<' if op == 'lt' else '<='} {right}"

    def choice(self, condition: str, then: PrintedText, other: PrintedText) -> PrintedText:
        """One if a condition holds, else another."""
        return PrintedText(
            f"{self.tight(then, Holds.SUM)} if {condition}, else {other.text}", Holds.CHOICE
        )

    def total(self, term: str, index: str) -> PrintedText:
        """The sum over the balls of a product."""
        return PrintedText(f"sum_{index} {term}", Holds.OPEN)

    def row(self, term: str, index: str, over: str) -> PrintedText:
        """The sum over the balls of a row's element times a product."""
        return PrintedText(f"sum_{over} B_{index}{over} {term}", Holds.OPEN)
