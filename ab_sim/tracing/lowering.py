"""Expressions as a machine computes them: no cosine, and products that are added are fused.

Every way out of code (``llvm_text``, ``c_text``, ``plain``) starts from lowered expressions, so all
of them round alike. Nothing is left to a compiler's judgement.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence

from ab_sim.tracing.expression import Expression, fma, neg, reached, rebuilt

QUARTERS = 0.6366197723675814
"""2/pi."""
ROUND = 6755399441055744.0
"""1.5 * 2^52: what is added to it is rounded to a whole number."""
PI_2A, PI_2B, PI_2C = 1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21
"""pi/2 in pieces of 33 bits, whose products with up to 2^20 quarters are exact; with more, what is
left by the first is, and the others are small."""
NOTHING: Mapping[Expression, Expression] = {}


def lowered(roots: Iterable[Expression]) -> list[Expression]:
    """The same roots without ``cos`` and ``sin``, with fused products."""
    return fused(without_cosines(roots))


def without_cosines(roots: Iterable[Expression]) -> list[Expression]:
    """Roots with their cosines and sines written out."""
    pairs: dict[int, tuple[Expression, Expression]] = {}

    def rule(x: Expression, args: Sequence[Expression]) -> Expression:
        if x.op not in ("cos", "sin"):
            return rebuilt(x, args)
        angle = args[0]
        if angle.number not in pairs:
            pairs[angle.number] = cos_sin(angle)
        return pairs[angle.number][x.op == "sin"]

    return mapped(roots, rule)


def fused(roots: Iterable[Expression]) -> list[Expression]:
    """Roots with each product that is used once, in a sum, fused with that sum.

    Not across levels: a product that is known before the run stays apart from what is not.
    """
    roots = list(roots)
    nodes = reached(roots)
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
    """Roots made anew from their inputs: each node by ``rule(node, its new arguments)``.

    ``inputs`` are what stands in the place of some of these.
    """
    roots = list(roots)
    new: dict[int, Expression] = {}
    for x in reached(roots):
        new[x.number] = rule(x, [new[arg.number] for arg in x.args]) if x.args else inputs.get(x, x)
    return [new[root.number] for root in roots]


def cos_sin(x: Expression) -> tuple[Expression, Expression]:
    """(cos x, sin x), each to within 2^-53 or so of 1 for abs(x) up to 10^9.

    By arithmetic alone, without a branch, so that it goes in lanes and is the same on every
    machine. Source: fdlibm's k_cos and k_sin (Sun Microsystems, 1993), with its three-piece
    reduction; the polynomials in pairs (Estrin), which wait less for each other than Horner's.
    """
    constant = x.graph.constant

    def polynomial(variable: Expression, one: float, zero: float) -> Expression:
        return fma(variable, constant(one), constant(zero))

    rounder = constant(ROUND)
    quarters = fma(x, constant(QUARTERS), rounder) - rounder
    r = fma(quarters, constant(-PI_2A), x)
    r = fma(quarters, constant(-PI_2C), fma(quarters, constant(-PI_2B), r))
    z = r * r
    zz = z * z
    s = polynomial(z, 1.58969099521155e-10, -2.5050760253406863e-08)
    s = fma(zz, s, polynomial(z, 2.7557313707070068e-06, -0.0001984126982985795))
    s = fma(zz, s, polynomial(z, 0.00833333333332249, -0.16666666666666632))
    s = fma(r * z, s, r)
    c = polynomial(z, -1.1359647557788195e-11, 2.087572321298175e-09)
    c = fma(zz, c, polynomial(z, -2.7557314351390663e-07, 2.480158728947673e-05))
    c = fma(zz, c, polynomial(z, -0.001388888888887411, 0.0416666666666666))
    half = 0.5 * z
    near = 1.0 - half
    c = near + fma(zz, c, (1.0 - near) - half)
    # Turn by the quarters left over, -2 .. 2: their cosine and sine are whole numbers.
    left = quarters - 4.0 * (fma(quarters, constant(0.25), rounder) - rounder)
    turn_c = 1.0 - abs(left)
    turn_s = left * (2.0 - abs(left))
    return c * turn_c - s * turn_s, s * turn_c + c * turn_s
