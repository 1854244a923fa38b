"""Print expressions as text for a terminal or a code block."""

from collections.abc import Callable, Mapping, Sequence

from ab_sim.tracing.expression import Expression
from ab_sim.tracing.printed import Holds, Notation, PrintedText, Printer


def plain_text(
    x: Expression, symbol: Callable[[str], str] = str, named: Mapping[int, str] | None = None
) -> str:
    """Return an expression as text: factors stand side by side, powers have a ``^``.

    Args:
        x: expression that is not lowered, so that it is printed as written.
        symbol: function that returns the text of an input's name; quantities per ball get an
            index i.
        named: symbols to print instead of nodes, by the nodes' numbers.
    """
    return Printer(PlainText(), symbol, named).text(x)


class PlainText(Notation):
    """Notation of plain text."""

    minus_leads = True

    def number(self, value: float) -> PrintedText:
        """Return a number that is neither negative nor a short fraction."""
        return PrintedText(f"{value:.12g}", Holds.ATOM)

    def fraction(self, top: int, bottom: int) -> PrintedText:
        """Return a number that is a short fraction."""
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
        """Return a power whose exponent is a whole number, 2 or more."""
        return PrintedText(f"{self.tight(base, Holds.ATOM)}^{by}", Holds.POWER)

    def function(self, name: str, argument: PrintedText, power: int = 1) -> PrintedText:
        """Return the text of a function (``cos``, ``sqrt`` or another), raised to a power."""
        text = f"|{argument.text}|" if name == "abs" else f"{name}({argument.text})"
        it = PrintedText(text, Holds.ATOM)
        return it if power == 1 else self.power(it, power)

    def comparison(self, op: str, left: str, right: str) -> str:
        """Return a comparison, ``lt`` or ``le``."""
        return f"{left} {'<' if op == 'lt' else '<='} {right}"

    def choice(self, condition: str, then: PrintedText, other: PrintedText) -> PrintedText:
        """Return a choice between two texts by a condition."""
        return PrintedText(
            f"{self.tight(then, Holds.SUM)} if {condition}, else {other.text}", Holds.CHOICE
        )

    def total(self, term: str, index: str) -> PrintedText:
        """Return the sum of a product over the balls."""
        return PrintedText(f"sum_{index} {term}", Holds.OPEN)

    def row(self, term: str, index: str, over: str) -> PrintedText:
        """Return the sum over the balls of a matrix element times a product."""
        return PrintedText(f"sum_{over} B_{index}{over} {term}", Holds.OPEN)
