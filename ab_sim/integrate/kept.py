"""Arguments that stay from call to call, where compiled code finds them.

Handed over as they are, a run's constants and arrays take numba as long at each call as ten steps
do: it looks through each of some forty Python objects. Here that is done once. Numbers, and
addresses and lengths of arrays, lie one after the other in memory, and a call passes where.
"""

import struct
from typing import Any

import numpy as np
from llvmlite import ir
from numba import typeof
from numba._dispatcher import compute_fingerprint
from numba.core import types
from numba.core.types.containers import BaseTuple
from numba.core.types.misc import NoneType
from numba.extending import (
    NativeValue,
    intrinsic,
    models,
    register_model,
    typeof_impl,
    unbox,
)
from numba.np.arrayobj import make_array, populate_array

_WORD = ir.IntType(64)


class KeptKind(types.Type):
    """Numba's type of a Kept.

    Args:
        content: that of the values.
    """

    def __init__(self, content: Any) -> None:
        super().__init__(f"Kept({content})")
        self.content = content


class Kept:
    """Values for a kernel, as they are now; what is in their arrays may change.

    Args:
        values: nested tuples of numbers, None and C-contiguous arrays.

    Raises:
        ValueError: an array is not C-contiguous.
    """

    def __init__(self, values: tuple[Any, ...]) -> None:
        self._values = values  # its arrays must not go
        self._words = np.array(_words(values), np.int64)
        self.address = int(self._words.ctypes.data)
        self.kind = _kind(values)


_kinds: dict[bytes, KeptKind] = {}


def _kind(values: tuple[Any, ...]) -> KeptKind:
    # By numba's own short form of what a type follows from: a type takes a hundred times longer.
    fingerprint = compute_fingerprint(values)
    if fingerprint not in _kinds:
        _kinds[fingerprint] = KeptKind(typeof(values))
    return _kinds[fingerprint]


def _words(value: Any) -> list[int]:
    words: list[int] = []
    _put(value, words)
    return words


def _put(value: Any, words: list[int]) -> None:
    """Append what stands for a value."""
    if isinstance(value, tuple):
        for part in value:
            _put(part, words)
    elif isinstance(value, np.ndarray):
        if not value.flags.c_contiguous:
            raise ValueError(f"an array of shape {value.shape} is not C-contiguous: copy it")
        words += value.__array_interface__["data"][0], *value.shape
    elif isinstance(value, float):
        words += _AS_WORD.unpack(_AS_FLOAT.pack(value))
    elif value is not None:
        words.append(int(value))


_AS_FLOAT, _AS_WORD = struct.Struct("d"), struct.Struct("q")


@register_model(KeptKind)
class _Model(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _WORD)


@typeof_impl.register(Kept)
def _kind_of(value: Kept, _: Any) -> KeptKind:
    return value.kind


@unbox(KeptKind)
def _address_of(kind: Any, value: Any, call: Any) -> Any:
    attribute = call.pyapi.object_getattr_string(value, "address")
    address = call.pyapi.long_as_longlong(attribute)
    call.pyapi.decref(attribute)
    return NativeValue(address)


@intrinsic
def values_of(typing_context, kept):  # type: ignore[no-untyped-def]
    """The values of a Kept, in compiled code."""
    content = kept.content

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        words, count = builder.inttoptr(arguments[0], _WORD.as_pointer()), 0

        def next_word() -> Any:
            nonlocal count
            count += 1
            return builder.load(builder.gep(words, [_WORD(count - 1)]))

        def read(kind: Any) -> Any:
            if isinstance(kind, BaseTuple):
                return context.make_tuple(builder, kind, [read(part) for part in kind.types])
            if isinstance(kind, types.Array):
                return _array(context, builder, kind, next_word)
            if isinstance(kind, NoneType):
                return context.get_dummy_value()
            if isinstance(kind, types.Float):
                return builder.bitcast(next_word(), ir.DoubleType())
            return context.cast(builder, next_word(), types.int64, kind)

        return read(content)

    return content(kept), generate


def _array(context: Any, builder: Any, kind: Any, next_word: Any) -> Any:
    number = context.get_data_type(kind.dtype)
    data = builder.inttoptr(next_word(), number.as_pointer())
    lengths = [next_word() for _ in range(kind.ndim)]
    item = strides = [_WORD(context.get_abi_sizeof(number))]
    for length in reversed(lengths[1:]):
        strides = [builder.mul(strides[0], length), *strides]
    array = make_array(kind)(context, builder)
    populate_array(array, data=data, shape=lengths, strides=strides, itemsize=item[0], meminfo=None)
    return array._getvalue()
