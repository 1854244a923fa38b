"""Lowered expressions as statements of C99, with the same bits as machine code made here.

To be compiled without ``-ffast-math`` and with ``-ffp-contract=off``: what is to be fused is said.
What each ball has is computed in a loop over the balls; sums over them call the functions of
``SUMS``.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from decimal import Decimal
from typing import NamedTuple

from ab_sim.tracing.expression import Expression, reached
from ab_sim.tracing.functions import GROUP

BALLS = "BALLS"
"""What the number of balls is called in C."""
SUMS = f"""\
/* The sum of the numbers of all balls, in the one order that ab_sim has: whole groups of {GROUP}
 * are added to each other, then the second half to the first until one is left; the last group, if
 * it is not whole, for itself. */
static double halved(double *x, int n)
{{
    while (n > 1) {{
        int half = 1;
        while (2 * half < n)
            half *= 2;
        for (int k = 0; half + k < n; k++)
            x[k] += x[half + k];
        n = half;
    }}
    return x[0];
}}

static double total(const double *each)
{{
    enum {{ WHOLE = {BALLS} / {GROUP} * {GROUP}, REST = {BALLS} - WHOLE }};
    double x[{GROUP}], rest[{GROUP}];
    for (int k = 0; k < {GROUP} && k < WHOLE; k++)
        x[k] = each[k];
    for (int at = {GROUP}; at < WHOLE; at += {GROUP})
        for (int k = 0; k < {GROUP}; k++)
            x[k] += each[at + k];
    for (int k = 0; k < REST; k++)
        rest[k] = each[WHOLE + k];
    if (REST == 0)
        return halved(x, {GROUP});
    if (WHOLE == 0)
        return halved(rest, REST);
    return halved(x, {GROUP}) + halved(rest, REST);
}}
"""
"""What ``total`` stands for: needs at least one ball."""
REPEATED = f"""\
static double repeated(double x)
{{
    double each[{BALLS}];
    for (int i = 0; i < {BALLS}; i++)
        each[i] = x;
    return total(each);
}}
"""
"""What ``repeated`` does, the sum of what is the same for all; behind ``SUMS``."""

_FORMS = {
    "add": "{} + {}",
    "sub": "{} - {}",
    "mul": "{} * {}",
    "div": "{} / {}",
    "neg": "-{}",
    "abs": "fabs({})",
    "sqrt": "sqrt({})",
    "fma": "fma({}, {}, {})",
    "lt": "{} < {}",
    "le": "{} <= {}",
    "where": "{} ? {} : {}",
}
_CALLS = ("abs", "sqrt", "fma")
_COMPARISONS = ("lt", "le")
_LONGEST = 64
"""Characters of an expression that stands within another one."""


class Store(NamedTuple):
    """A root, and the C text of where it goes."""

    root: Expression
    target: str
    """What each ball has has the index ``[i]`` in it: ``"slope[4 + i]"``."""
    each: bool = False
    """Whether it goes to each ball; of what is the same for all, too."""


def c_statements(
    stores: Sequence[Store], inputs: Mapping[str, str], known: Mapping[int, str] | None = None
) -> list[str]:
    """The lines of a function's body that computes some expressions.

    Args:
        stores: what is computed: lowered; nothing that is read may lie where something goes.
        inputs: by input's name the C text of where it is; of what each ball has ending in ``[i]``.
        known: by number of a node, the C text of where its value is already.

    Raises:
        ValueError: an operation is for machine code only: lanes, or rows of balls that touch.
    """
    return _Statements(stores, inputs, known or {}).lines()


def c_literal(value: float) -> str:
    """A number in C, to the last bit: in decimals where these are exact."""
    if value != value:
        return "NAN"
    if value in (float("inf"), float("-inf")):
        return "INFINITY" if value > 0 else "(-INFINITY)"
    short = repr(value)
    text = short if len(short) < 12 and Decimal(short) == Decimal(value) else value.hex()
    return f"({text})" if text.startswith("-") else text


class _Statements:
    """Nodes in the order in which they are computed: numbers, a loop over the balls, and so on.

    A node's *round* is the loop that it is computed in, or before: a sum over the balls is in the
    round after its terms.
    """

    def __init__(
        self, stores: Sequence[Store], inputs: Mapping[str, str], known: Mapping[int, str]
    ) -> None:
        self._stores, self._inputs, self._known = stores, inputs, known
        self._nodes = reached([store.root for store in stores], known)
        self._round: dict[int, int] = {}
        for x in self._nodes:
            behind = x.op == "total" and x.args[0].each
            self._round[x.number] = max(
                (self._round[arg.number] for arg in self._args(x)), default=0
            ) + int(behind)
        users = [(arg.number, x) for x in self._nodes for arg in self._args(x)]
        self._uses = Counter(number for number, _ in users)
        self._uses.update(store.root.number for store in stores)
        self._user = dict(users)
        """By number of a node what computes with it; of those with several uses, one."""
        self._columns = self._kept()
        self._text: dict[int, str] = {}
        """Of a node, as it stands in another expression."""

    def _args(self, x: Expression) -> tuple[Expression, ...]:
        return () if x.number in self._known else x.args

    def _kept(self) -> set[int]:
        """What of each ball a later round needs, or a sum: it has an array."""
        found = set()
        for x in self._nodes:
            for arg in self._args(x):
                later = self._round[x.number] > self._round[arg.number]
                if arg.each and (later or x.op == "total"):
                    found.add(arg.number)
        return found

    def lines(self) -> list[str]:
        """All of them."""
        found: list[str] = []
        last = max(self._round.values(), default=0)
        for turn in range(last + 1):
            nodes = [x for x in self._nodes if self._round[x.number] == turn]
            for x in nodes:
                if not x.each:
                    found += self._computed(x)
            loop: list[str] = []
            for x in nodes:
                if x.each:
                    if x.number in self._columns and not self._at_hand(x):
                        kind = "int" if x.op in _COMPARISONS else "double"
                        found.append(f"{kind} t{x.number}[{BALLS}];")
                    loop += self._computed(x)
            for store in self._stores:
                if (store.each or store.root.each) and self._round[store.root.number] == turn:
                    loop.append(self._stored(store))
            if loop:
                body = [f"    {line}" for line in loop]
                found += [f"for (int i = 0; i < {BALLS}; i++) {{", *body, "}"]
        for store in self._stores:
            if not (store.each or store.root.each):
                found.append(self._stored(store))
        return found

    def _stored(self, store: Store) -> str:
        text = self._of(store.root)
        inlined = text.startswith("(") and store.root.op != "const"
        return f"{store.target} = {text[1:-1] if inlined else text};"

    def _at_hand(self, x: Expression) -> bool:
        return x.number in self._known or x.op in ("const", "input")

    def _computed(self, x: Expression) -> list[str]:
        """The line that computes a node; none if it is at hand, or stands where it is used."""
        number = x.number
        if number in self._known:
            self._text[number] = self._known[number]
            return []
        if x.op == "const":
            self._text[number] = c_literal(x.payload)
            return []
        if x.op == "input":
            self._text[number] = self._inputs[x.payload]
            return []
        form = self._form(x)
        if number in self._columns:
            self._text[number] = f"t{number}[i]"
            return [f"t{number}[i] = {form};"]
        if self._uses[number] == 1 and len(form) <= _LONGEST and self._used_near(x):
            self._text[number] = form if x.op in _CALLS or x.op == "total" else f"({form})"
            return []
        self._text[number] = f"t{number}"
        kind = "int" if x.op in _COMPARISONS else "double"
        return [f"const {kind} t{number} = {form};"]

    def _used_near(self, x: Expression) -> bool:
        """Whether its one use is in the same loop, or outside of all as it is."""
        user = self._user.get(x.number)
        if user is not None:
            same_round = self._round[user.number] == self._round[x.number]
            return user.each == x.each and (same_round or not x.each)
        (store,) = (store for store in self._stores if store.root is x)
        return x.each or not store.each

    def _form(self, x: Expression) -> str:
        if x.op == "total":
            arg = x.args[0]
            if arg.each:
                return f"total({self._of(arg).removesuffix('[i]')})"
            return f"repeated({self._of(arg)})"
        if x.op not in _FORMS:
            raise ValueError(f"{x.op}: has no C text; it is for machine code only")
        return _FORMS[x.op].format(*map(self._of, x.args))

    def _of(self, x: Expression) -> str:
        return self._text[x.number]
