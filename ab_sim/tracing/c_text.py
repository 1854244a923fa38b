"""Emit lowered expressions as C99 statements, bitwise equal to the machine code of this package.

Compile the C without ``-ffast-math`` and with ``-ffp-contract=off``: fused operations are written
as calls of ``fma``, so the compiler must not add any. Quantities per ball are computed in loops
over the balls; sums over the balls call the functions of ``SUMS``.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from decimal import Decimal
from typing import NamedTuple

from ab_sim.tracing.expression import Expression, reachable_nodes
from ab_sim.tracing.functions import GROUP

BALLS = "BALLS"
"""Name of the number of balls in C."""
SUMS = f"""\
/* Sum over the balls, in the order in which ab_sim adds: whole groups of {GROUP} are added to each
 * other, then the second half of the group to the first until one number is left. A last group that
 * is not whole is summed separately. */
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
"""C source of ``total``, the sum over the balls; it needs at least one ball."""
REPEATED = f"""\
static double repeated(double x)
{{
    double each[{BALLS}];
    for (int i = 0; i < {BALLS}; i++)
        each[i] = x;
    return total(each);
}}
"""
"""C source of ``repeated``, the sum of a value that all balls share; placed after ``SUMS``."""

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
"""Maximum number of characters of an expression that is written inside another one."""


class Store(NamedTuple):
    """Expression to compute (a root), and the C variable that gets the value."""

    root: Expression
    target: str
    """C lvalue; for a quantity per ball with the index ``i``: ``"slope[4 + i]"``."""
    each: bool = False
    """True to store a value per ball, even if the value is the same for all balls."""


def c_statements(
    stores: Sequence[Store], inputs: Mapping[str, str], known_texts: Mapping[int, str] | None = None
) -> list[str]:
    """Return the lines of a C function body that computes expressions.

    Parameters
    ----------
    stores
        Lowered roots and their destinations, which must not overlap any input.
    inputs
        C text of each input by its name, ending in ``[i]`` for a quantity per ball.
    known_texts
        C text of values that are already available, by the number of their node.

    Raises
    ------
    ValueError
        An operation exists in machine code only: lanes, or rows of touching balls.
    """
    return _Statements(stores, inputs, known_texts or {}).lines()


def c_literal(value: float) -> str:
    """Return a number as an exact C literal: decimal if short and exact, else hexadecimal."""
    if value != value:
        return "NAN"
    if value in (float("inf"), float("-inf")):
        return "INFINITY" if value > 0 else "(-INFINITY)"
    short = repr(value)
    text = short if len(short) < 12 and Decimal(short) == Decimal(value) else value.hex()
    return f"({text})" if text.startswith("-") else text


class _Statements:
    """Order of computation: scalars, then a loop over the balls, then again scalars, and so on.

    The loops are numbered in *rounds*: a node's round is that of the loop in which it is computed,
    or before which it is computed if it is a scalar. A sum over the balls is one round later than
    its terms, because it needs the finished loop.
    """

    def __init__(
        self, stores: Sequence[Store], inputs: Mapping[str, str], known_texts: Mapping[int, str]
    ) -> None:
        self._stores, self._inputs, self._known = stores, inputs, known_texts
        self._nodes = reachable_nodes([store.root for store in stores], known_texts)
        self._round: dict[int, int] = {}
        for x in self._nodes:
            after_loop = x.op == "total" and x.args[0].each
            self._round[x.number] = max(
                (self._round[arg.number] for arg in self._args(x)), default=0
            ) + int(after_loop)
        users = [(arg.number, x) for x in self._nodes for arg in self._args(x)]
        self._uses = Counter(number for number, _ in users)
        self._uses.update(store.root.number for store in stores)
        self._user = dict(users)
        """One of the users of each node, by the node's number."""
        self._columns = self._kept()
        self._text: dict[int, str] = {}
        """C text of each node as an operand, by the node's number."""

    def _args(self, x: Expression) -> tuple[Expression, ...]:
        """Return a node's arguments; none for a node whose value is known."""
        return () if x.number in self._known else x.args

    def _kept(self) -> set[int]:
        """Return the numbers of per-ball nodes that need an array, for a later round or a sum."""
        kept = set()
        for x in self._nodes:
            for arg in self._args(x):
                later = self._round[x.number] > self._round[arg.number]
                if arg.each and (later or x.op == "total"):
                    kept.add(arg.number)
        return kept

    def lines(self) -> list[str]:
        """Return all lines: in each round first its scalars, then its loop; scalar roots last."""
        texts: list[str] = []
        last = max(self._round.values(), default=0)
        for turn in range(last + 1):
            nodes = [x for x in self._nodes if self._round[x.number] == turn]
            for x in nodes:
                if not x.each:
                    texts += self._computed(x)
            loop: list[str] = []
            for x in nodes:
                if x.each:
                    if x.number in self._columns and not self._at_hand(x):
                        kind = "int" if x.op in _COMPARISONS else "double"
                        texts.append(f"{kind} t{x.number}[{BALLS}];")
                    loop += self._computed(x)
            for store in self._stores:
                if (store.each or store.root.each) and self._round[store.root.number] == turn:
                    loop.append(self._stored(store))
            if loop:
                body = [f"    {line}" for line in loop]
                texts += [f"for (int i = 0; i < {BALLS}; i++) {{", *body, "}"]
        for store in self._stores:
            if not (store.each or store.root.each):
                texts.append(self._stored(store))
        return texts

    def _stored(self, store: Store) -> str:
        """Return the C assignment of a root's value; the expression has no outer brackets."""
        text = self._of(store.root)
        inlined = text.startswith("(") and store.root.op != "const"
        return f"{store.target} = {text[1:-1] if inlined else text};"

    def _at_hand(self, x: Expression) -> bool:
        """Return whether a node needs no computation."""
        return x.number in self._known or x.op in ("const", "input")

    def _computed(self, x: Expression) -> list[str]:
        """Return the C line that computes a node; none for a node that is available or inlined.

        A node is written inside its user if that is its only one, in the same loop, and the text
        is short. All others get a variable, or an element of an array if a later loop reads them.
        """
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
        """Return whether a node and its only use are in the same loop, or both outside loops."""
        user = self._user.get(x.number)
        if user is not None:
            same_round = self._round[user.number] == self._round[x.number]
            return user.each == x.each and (same_round or not x.each)
        (store,) = (store for store in self._stores if store.root is x)
        return x.each or not store.each

    def _form(self, x: Expression) -> str:
        """Return the C expression of a node's operation."""
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
