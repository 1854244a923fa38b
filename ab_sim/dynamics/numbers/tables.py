"""Nested tuples whose floats come from a table: what is a tuple of floats elsewhere, with lanes."""

from typing import Any

import numpy as np
from numba.core import types
from numba.core.types.containers import BaseNamedTuple, BaseTuple
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

from ab_sim.dynamics.numbers.kinds import BYTES, SeveralFloats

_FLOAT = 8
"""Bytes to which a float is aligned."""


@intrinsic
def spread(typing_context, pattern, table):  # type: ignore[no-untyped-def]
    """A nested tuple like ``pattern`` with the table's numbers for its floats.

    Args:
        pattern: its values are of no account, but for what is not a float.
        table: array of lanes, duals or floats, shape (floats in the pattern,): see ``leaves``.
    """

    def wide(kind: Any) -> Any:
        if isinstance(kind, BaseNamedTuple):
            return BaseTuple.from_types([wide(k) for k in kind.types], kind.instance_class)
        if isinstance(kind, BaseTuple):
            return BaseTuple.from_types([wide(k) for k in kind.types])
        return table.dtype if isinstance(kind, types.Float) else kind

    result = wide(pattern)

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        entries = make_array(signature.args[1])(context, builder, value=arguments[1])
        # Of an array of floats numba says that it is aligned if each of them is.
        whole = table.aligned and isinstance(table.dtype, SeveralFloats)
        place = 0

        def fill(kind: Any, value: Any) -> Any:
            nonlocal place
            if isinstance(kind, BaseTuple):
                parts = [
                    fill(part, builder.extract_value(value, i)) for i, part in enumerate(kind.types)
                ]
                return context.make_tuple(builder, wide(kind), parts)
            if not isinstance(kind, types.Float):
                return value
            at = builder.gep(entries.data, [context.get_constant(types.intp, place)])
            place += 1
            return builder.load(at, align=BYTES if whole else _FLOAT)

        return fill(signature.args[0], arguments[0])

    return result(pattern, table), generate


def leaves(values: Any) -> list[float]:
    """The floats of nested tuples, in the order in which ``spread`` reads them."""
    if isinstance(values, tuple):
        return [leaf for value in values for leaf in leaves(value)]
    return [values] if isinstance(values, float) else []


def pattern(values: Any) -> Any:
    """What of nested tuples is no float: their kinds, and all that is the same in all lanes."""
    if isinstance(values, tuple):
        return type(values), *map(pattern, values)
    if isinstance(values, np.ndarray):
        return np.ndarray, values.shape, values.tobytes()
    return float if isinstance(values, float) else (type(values), values)
