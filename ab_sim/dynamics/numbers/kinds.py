"""What lanes and duals have in common: they are several floats, to the compiler one vector.

And how such a kind of number is given its rules: which operations there are, ``rule`` tells numba.
"""

import itertools
from collections.abc import Callable
from typing import Any, NamedTuple

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.errors import TypingError
from numba.core.imputils import lower_builtin
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, models, register_model
from numba.np.arrayobj import make_array, populate_array

EIGHT = 8
VECTOR = ir.VectorType(ir.DoubleType(), EIGHT)
BYTES = 8 * EIGHT
FIRST = ir.Constant(ir.IntType(32), 0)
"""The first place in a vector."""


class SeveralFloats(types.Type):
    """Numba's type of such a number."""

    def __init__(self, name: str, width: int) -> None:
        super().__init__(name)
        self.width = width

    @property
    def vector(self) -> ir.VectorType:
        """What it is to the compiler."""
        return ir.VectorType(ir.DoubleType(), self.width)

    def can_convert_from(self, typing_context: Any, other: Any) -> Any:
        """A plain number can be one; the other kind cannot."""
        return Conversion.safe if isinstance(other, types.Number) else None

    def unify(self, typing_context: Any, other: Any) -> Any:
        """What a variable is that is sometimes a plain number."""
        return self if isinstance(other, types.Number) else None


lanes = SeveralFloats("lanes", EIGHT)
duals = SeveralFloats("duals", EIGHT)


@register_model(SeveralFloats)
class _Model(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, kind.vector)


def kind_among(arguments: tuple[Any, ...]) -> SeveralFloats | None:
    """The one kind that numba's types of an operation's arguments have beside plain numbers."""
    found = {kind for kind in arguments if not isinstance(kind, types.Number)}
    if len(found) == 1:
        (kind,) = found
        if isinstance(kind, SeveralFloats):
            return kind
    return None


class Call(NamedTuple):
    """Where the code of a rule goes."""

    context: Any
    """Numba's target context."""
    builder: Any
    """LLVM's builder of instructions."""
    kinds: tuple[Any, ...]
    """Numba's types of the arguments."""


def rule(
    kind: SeveralFloats, count: int, *operations: Any, result: Any = None
) -> Callable[[Callable[..., Any]], None]:
    """Decorator of ``generate(call, *arguments)``: the code for operations on a kind of number.

    Args:
        kind: ``lanes`` or ``duals``; some of the arguments may be plain numbers.
        count: how many arguments the operations have.
        operations: functions that are the same in compiled code, as an operator and its in-place
            form.
        result: numba's type of the result; the kind itself if not given.
    """

    class Typing(AbstractTemplate):  # type: ignore[misc]
        def generic(self, args: Any, kws: Any) -> Any:
            if len(args) != count or kind_among(args) != kind:
                return None
            return signature(result or kind, *args)

    def register(generate: Callable[..., Any]) -> None:
        def lower(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return generate(Call(context, builder, signature.args), *arguments)

        for operation in operations:
            infer_global(operation)(Typing)
            for kinds in itertools.product((kind, types.Number), repeat=count):
                if kind in kinds:
                    lower_builtin(operation, *kinds)(lower)

    return register


def converted(call: Call, to: Any, arguments: tuple[Any, ...]) -> list[Any]:
    """The arguments of a call as numbers of a kind."""
    return [
        call.context.cast(call.builder, argument, kind, to)
        for argument, kind in zip(arguments, call.kinds, strict=True)
    ]


def call_of(builder: Any, name: str, *values: Any) -> Any:
    """LLVM's intrinsic function of that name; llvmlite's own way to call it knows no vectors."""
    number = values[0].type
    suffix = f"v{number.count}f64" if isinstance(number, ir.VectorType) else "f64"
    kinds = ir.FunctionType(number, [number] * len(values))
    function = cgutils.get_or_insert_function(builder.module, kinds, f"llvm.{name}.{suffix}")
    return builder.call(function, values)


def in_all(builder: Any, number: Any, width: int = EIGHT) -> Any:
    """A vector that has the float at each place."""
    nothing = ir.Constant(ir.VectorType(ir.DoubleType(), width), ir.Undefined)
    first = builder.insert_element(nothing, number, FIRST)
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), width), [0] * width)
    return builder.shuffle_vector(first, nothing, zeros)


def viewed_as(kind: SeveralFloats, aligned: bool) -> Any:
    """A function for compiled code: an array of floats, whose last axis has length 8, as numbers.

    Args:
        kind: ``lanes`` or ``duals``.
        aligned: whether all such arrays begin at a multiple of 64 bytes, which the code then relies
            on: see ``integrate.workspace.aligned``.
    """

    @intrinsic
    def view(typing_context, array):  # type: ignore[no-untyped-def]
        if not (isinstance(array, types.Array) and array.layout == "C"):
            raise TypingError(f"{array}: must be a C-contiguous array of floats to be {kind}")
        if array.dtype != types.float64:
            raise TypingError(f"{array}: must hold float64 to be {kind}; convert it")
        result_kind = types.Array(kind, array.ndim - 1, "C", aligned=aligned)

        def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
            source = make_array(signature.args[0])(context, builder, value=arguments[0])
            result = make_array(result_kind)(context, builder)
            populate_array(
                result,
                data=builder.bitcast(source.data, VECTOR.as_pointer()),
                shape=cgutils.unpack_tuple(builder, source.shape)[:-1],
                strides=cgutils.unpack_tuple(builder, source.strides)[:-1],
                itemsize=context.get_constant(types.intp, BYTES),
                meminfo=None,
            )
            return result._getvalue()

        return result_kind(array), generate

    return view
