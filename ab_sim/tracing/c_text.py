"""Lowered expressions as a C function (C99), with the same bits as machine code made here.

To be compiled without ``-ffast-math`` and with ``-ffp-contract=off``: what is to be fused is said.
"""

from collections.abc import Mapping, Sequence

from ab_sim.tracing.expression import Expression, reached

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


def c_function(
    name: str,
    pointers: Sequence[str],
    roots: Sequence[tuple[Expression, str]],
    inputs: Mapping[str, str],
) -> str:
    """A function that reads and writes arrays of doubles.

    Args:
        name: of the function.
        pointers: its arguments, ``"const double *y"`` and the like.
        roots: what it computes: lowered expressions without the balls' axis, each with the C text
            of where it goes, ``"slope[3]"``.
        inputs: by input's name the C text of where it is.
    """
    lines, known = [], {}
    for x in reached([root for root, _ in roots]):
        if x.op == "const":
            known[x.number] = _literal(x.payload)
            continue
        kind = "int" if x.op in ("lt", "le") else "double"
        known[x.number] = f"t{x.number}"
        form = (
            inputs[x.payload]
            if x.op == "input"
            else _FORMS[x.op].format(*(known[arg.number] for arg in x.args))
        )
        lines.append(f"    const {kind} {known[x.number]} = {form};")
    lines += [f"    {target} = {known[root.number]};" for root, target in roots]
    return f"void {name}({', '.join(pointers)})\n{{\n" + "\n".join(lines) + "\n}\n"


def _literal(value: float) -> str:
    if value != value:
        return "NAN"
    if value in (float("inf"), float("-inf")):
        return "INFINITY" if value > 0 else "(-INFINITY)"
    return f"({value.hex()})"
