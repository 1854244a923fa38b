"""Functions called by their address: what is compiled apart from a kernel, and calls it back.

Numba compiles all that a kernel calls for the kernel's own types, anew for each scene. What does
not depend on a scene is compiled once instead; a kernel knows where in memory it is, and gives it
addresses: of the kernel's own functions, and of what these are to be given. An address is good for
as long as the function that took it runs: take it in the kernel itself, not in a function that is
inlined there.
"""

import itertools
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.types.containers import BaseTuple
from numba.core.types.misc import NoneType
from numba.extending import intrinsic

_ADDRESS = types.int64
_numbers = itertools.count()


def _pointer(context: Any, builder: Any, kind: Any, address: Any) -> Any:
    return builder.inttoptr(address, context.get_value_type(kind).as_pointer())


def _as_kind(context: Any, builder: Any, value: Any, given: Any, wanted: Any) -> Any:
    """A value as one of another type: of nested tuples, each number as it is wanted.

    Of a tuple that stands for a number, or a truth value, its length: see ``dispatch.number_of``.
    """
    if isinstance(given, BaseTuple) and isinstance(wanted, types.Number | types.Boolean):
        return context.get_constant(wanted, len(given))
    if not isinstance(wanted, BaseTuple):
        return context.cast(builder, value, given, wanted)
    parts = [
        _as_kind(context, builder, builder.extract_value(value, i), *kinds)
        for i, kinds in enumerate(zip(given.types, wanted.types, strict=True))
    ]
    return context.make_tuple(builder, wanted, parts)


def _nowhere(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return context.get_constant(_ADDRESS, 0)


def address_of(kind: Any = None) -> Any:
    """A function ``take(value)``: puts the value into memory and says where; of None, 0.

    Args:
        kind: numba's type to store it as; its own by default.
    """

    @intrinsic
    def take(typing_context, value):  # type: ignore[no-untyped-def]
        wanted = value if kind is None else kind
        if isinstance(value, NoneType):
            return _ADDRESS(value), _nowhere

        def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
            stored = _as_kind(context, builder, arguments[0], signature.args[0], wanted)
            place = cgutils.alloca_once(builder, stored.type)
            builder.store(stored, place)
            return builder.ptrtoint(place, context.get_value_type(_ADDRESS))

        return _ADDRESS(value), generate

    return take


def value_at(kind: Any) -> Any:
    """A function ``read(address)``: a value of numba's type ``kind`` that is there."""

    @intrinsic
    def read(typing_context, address):  # type: ignore[no-untyped-def]
        def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
            return builder.load(_pointer(context, builder, kind, arguments[0]))

        return kind(_ADDRESS), generate

    return read


def call_at(result: Any, *kinds: Any) -> Any:
    """A function ``call(address, arguments)`` of a tuple of arguments.

    Args:
        result: numba's type of what is returned.
        kinds: those of the arguments.
    """

    @intrinsic
    def call(typing_context, address, arguments):  # type: ignore[no-untyped-def]
        def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
            given = signature.args[1].types
            passed = [
                _as_kind(context, builder, builder.extract_value(values[1], i), *pair)
                for i, pair in enumerate(zip(given, kinds, strict=True))
            ]
            function = context.call_conv.get_function_type(result, kinds)
            pointer = builder.inttoptr(values[0], function.as_pointer())
            _, value = context.call_conv.call_function(builder, pointer, result, kinds, passed)
            return value

        return result(_ADDRESS, arguments), generate

    return call


def callback(function: Any, result: Any, *kinds: Any) -> Any:
    """A function ``take(context)``: the address of code that calls ``function``; of None, 0.

    Called with the address of such a context and further arguments, the code calls
    ``function(context, *arguments)``.

    Args:
        function: compiled by numba, of a context and the arguments.
        result: numba's type of what it returns.
        kinds: those of the arguments.
    """
    given = (_ADDRESS, *kinds)

    @intrinsic
    def take(typing_context, owner):  # type: ignore[no-untyped-def]
        if isinstance(owner, NoneType):
            return _ADDRESS(owner), _nowhere
        called = typing_context.resolve_value_type(function)
        inner = called.get_call_type(typing_context, (owner, *kinds), {})

        def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
            convention = context.call_conv
            wrapper = ir.Function(
                builder.module,
                convention.get_function_type(result, given),
                f"{function.__name__}.callback.{next(_numbers)}",
            )
            wrapper.linkage = "internal"
            convention.decorate_function(wrapper, [f"a{i}" for i in range(len(given))], given)
            body = ir.IRBuilder(wrapper.append_basic_block())
            values = convention.decode_arguments(body, given, wrapper)
            handed = body.load(_pointer(context, body, owner, values[0]))
            value = context.get_function(called, inner)(body, [handed, *values[1:]])
            value = context.cast(body, value, inner.return_type, result)
            convention.return_value(body, value)
            return builder.ptrtoint(wrapper, context.get_value_type(_ADDRESS))

        return _ADDRESS(owner), generate

    return take


def compiled_address(kernel: Callable[..., Any], *kinds: Any) -> int:
    """Where the machine code of a kernel for these argument types is; compiled if need be."""
    dispatcher: Any = kernel
    dispatcher.compile(kinds)
    found = dispatcher.overloads[kinds]
    return int(found.library.get_pointer_to_function(found.fndesc.llvm_func_name))
