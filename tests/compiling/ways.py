"""Runs of one function of the compilable subset as Python and as code of several processors."""

import copy
import functools
import math
import struct
from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np

from ab_sim.engine.compiling import Compiled, Library

PLAIN, NARROW = "+sse2", "+sse4.2,+avx,+avx2,+fma,-avx512f"
"""Features of a processor without fused multiply-add, and of one without AVX-512."""
LIBRARIES = {features: Library(features) for features in (None, PLAIN, NARROW)}


@functools.cache
def machine_code(function: Callable[..., Any], features: str | None = None) -> Compiled:
    """Compile a function for a processor's features."""
    assert isinstance(function, FunctionType)
    return Compiled(function, library=LIBRARIES[features])


def same(function: Callable[..., Any], *arguments: Any) -> Any:
    """Return the function's result after checking that all ways give and write the same values.

    Signs and payloads of NaNs are not compared, because they depend on the processor.
    """
    given = copy.deepcopy(arguments)
    expected = function(*given)
    for features in LIBRARIES:
        again = copy.deepcopy(arguments)
        found = machine_code(function, features)(*again)
        assert agree(found, expected), (features, found, expected)
        assert agree(again, given), (features, again, given)
    return expected


def agree(found: Any, expected: Any) -> bool:
    """Return whether values agree to the bit; Python's result may be an int instead of a float."""
    if isinstance(found, np.ndarray):
        return found.shape == expected.shape and agree(
            tuple(found.ravel().tolist()), tuple(expected.ravel().tolist())
        )
    if isinstance(found, tuple):
        pairs = zip(found, expected, strict=True)
        return type(found) is type(expected) and all(agree(*pair) for pair in pairs)
    if isinstance(found, float):
        both_nan = math.isnan(found) and math.isnan(expected)
        return both_nan or struct.pack("<d", found) == struct.pack("<d", float(expected))
    return bool(type(found) is type(expected) and found == expected)
