"""What functions of the subset are annotated with, and functions that they may call.

Arrays are C-contiguous. All of this works in ordinary Python, too: functions of the subset run
there as they are, with any numpy arrays.
"""

import ctypes
import math
import struct
from collections.abc import Callable
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ab_sim.tracing import functions


class Array(NamedTuple):
    """Marks an annotation: an array of numbers."""

    rank: int
    element: type[float] | type[int]


Floats = Annotated[NDArray[np.float64], Array(1, float)]
Table = Annotated[NDArray[np.float64], Array(2, float)]
Cube = Annotated[NDArray[np.float64], Array(3, float)]
Integers = Annotated[NDArray[np.int64], Array(1, int)]
IntegerTable = Annotated[NDArray[np.int64], Array(2, int)]


def aligned(shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Zeros that begin at a cache line: numpy's own alignment costs 10 % or so, at random."""
    size = math.prod(shape)
    raw = np.zeros(size + 8)
    first = -raw.ctypes.data % 64 // 8
    return raw[first : first + size].reshape(shape)


def scratch(*shape: int) -> NDArray[np.float64]:
    """An array of one or two axes on the stack, aligned to 64 bytes; what is in it is not defined.

    It is gone when the function that calls this returns. In a loop each round gets the same memory;
    there the shape has to be constant.
    """
    return aligned(shape)


fma: Callable[[float, float, float], float] = functions.fma
"""a b + c, rounded once."""


def put_product(
    out: NDArray[np.float64], factors: NDArray[np.float64], rows: NDArray[np.float64]
) -> None:
    """Factors times rows, of as many columns as ``out`` has: term by term, each rounded once.

    Args:
        out: shape (n,); no part of the others.
        factors: shape (m,), m more than 0.
        rows: shape (m or more, n or more).
    """
    for j in range(out.size):
        out[j] = 0.0
        for k in range(factors.size):
            out[j] = fma(factors[k], rows[k, j], out[j])


def float_from_bits(word: int) -> float:
    """The floating-point number that a 64-bit word says, as IEEE 754 has it."""
    made: float = struct.unpack("<d", struct.pack("<q", word))[0]
    return made


def call(address: int, *arguments: Any) -> None:
    """Call emitted code: arrays go as pointers to their first number, others as i64 and double.

    It returns nothing; it writes into arrays. In ordinary Python the address may also be a
    callable of these arguments.
    """
    if callable(address):
        address(*arguments)
        return
    kinds: list[Any] = [_C_KINDS.get(type(x), ctypes.c_void_p) for x in arguments]
    function: Callable[..., None] = ctypes.CFUNCTYPE(None, *kinds)(address)
    function(*[x.ctypes.data if isinstance(x, np.ndarray) else x for x in arguments])


_C_KINDS: dict[type, Any] = {
    float: ctypes.c_double,
    np.float64: ctypes.c_double,
    int: ctypes.c_int64,
    np.int64: ctypes.c_int64,
}
