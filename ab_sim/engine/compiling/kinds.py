"""Annotations for functions of the subset, and functions that these may call.

Arrays are C-contiguous. Functions of the subset also run in ordinary Python without change, with
any numpy arrays.
"""

import ctypes
import math
from collections.abc import Callable
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ab_sim.tracing import functions


class Array(NamedTuple):
    """Marker in the annotation of an array: number of axes, and type of the elements."""

    rank: int
    element: type[float] | type[int]


Floats = Annotated[NDArray[np.float64], Array(1, float)]
Table = Annotated[NDArray[np.float64], Array(2, float)]
Cube = Annotated[NDArray[np.float64], Array(3, float)]
Integers = Annotated[NDArray[np.int64], Array(1, int)]
IntegerTable = Annotated[NDArray[np.int64], Array(2, int)]


def aligned(shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return an array of zeros that begins at a cache line.

    numpy's own arrays may begin within a cache line, which makes code about 10 % slower, at random.
    """
    size = math.prod(shape)
    raw = np.zeros(size + 8)
    first = -raw.ctypes.data % 64 // 8
    return raw[first : first + size].reshape(shape)


def scratch(*shape: int) -> NDArray[np.float64]:
    """Return an uninitialized array of one or two axes on the stack, aligned to 64 bytes.

    It lives until the calling function returns. In a loop, its shape must be constant, and each
    iteration gets the same memory.
    """
    return aligned(shape)


fma: Callable[[float, float, float], float] = functions.fma
"""Fused multiply-add: a b + c, rounded once."""


def call(address: int, *arguments: Any) -> None:
    """Call emitted code, which returns nothing and writes its results into arrays.

    Arrays are passed as pointers to their first number, ints as i64 and floats as double. In
    ordinary Python, the address may also be a callable of these arguments.
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
