"""Lower expressions to arithmetic: expand cosines, and fuse products with the sums that use them.

All emitters (``llvm_text``, ``c_text``, ``plain``) start from lowered expressions, so their results
are rounded alike. Compilers are not free to choose which operations to fuse.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from ab_sim.tracing.cosine import cos_sin
from ab_sim.tracing.expression import Expression, fma, neg, reachable_nodes, rebuilt

NOTHING: Mapping[Expression, Expression] = {}
"""Default of ``mapped``: no input is replaced."""


def lowered(roots: Iterable[Expression]) -> list[Expression]:
    """Return the roots without ``cos`` and ``sin``, and with fused products."""
    return fused(without_cosines(roots))


def without_cosines(roots: Iterable[Expression]) -> list[Expression]:
    """Return the roots with their cosines and sines expanded into arithmetic."""
    pairs: dict[int, Any] = {}

    def rule(x: Expression, args: Sequence[Expression]) -> Expression:
        if x.op not in ("cos", "sin"):
            return rebuilt(x, args)
        angle: Any = args[0]
        if angle.number not in pairs:
            pairs[angle.number] = cos_sin(angle)
        replacement: Expression = pairs[angle.number][x.op == "sin"]
        return replacement

    return mapped(roots, rule)


def fused(roots: Iterable[Expression]) -> list[Expression]:
    """Return the roots with products fused into sums (``fma``).

    A product is fused if its only use is in a sum. If both terms of a sum are such products, the
    first one is fused. Products are not fused across levels, so that a product that is known before
    the run can be computed once.
    """
    roots = list(roots)
    nodes = reachable_nodes(roots)
    uses = Counter(arg.number for x in nodes for arg in x.args)
    uses.update(root.number for root in roots)
    once = {x.number for x in nodes if x.op == "mul" and uses[x.number] == 1}

    def rule(x: Expression, args: Sequence[Expression]) -> Expression:
        if x.op in ("add", "sub"):
            minus = x.op == "sub"
            for k, (was, now, other) in enumerate(zip(x.args, args, args[::-1], strict=True)):
                if was.number in once and now.op == "mul" and now.level == x.level:
                    a, b = now.args
                    if k == 0:
                        return fma(a, b, neg(other) if minus else other)
                    return fma(neg(a) if minus else a, b, other)
        return rebuilt(x, args)

    return mapped(roots, rule)


def mapped(
    roots: Iterable[Expression],
    rule: Callable[[Expression, Sequence[Expression]], Expression],
    inputs: Mapping[Expression, Expression] = NOTHING,
) -> list[Expression]:
    """Return the roots rebuilt from their inputs, each node by ``rule(node, its new arguments)``.

    ``inputs`` maps inputs to their replacements.
    """
    roots = list(roots)
    new: dict[int, Expression] = {}
    for x in reachable_nodes(roots):
        new[x.number] = rule(x, [new[arg.number] for arg in x.args]) if x.args else inputs.get(x, x)
    return [new[root.number] for root in roots]
