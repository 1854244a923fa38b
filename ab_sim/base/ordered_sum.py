"""Sums of products in a fixed order.

BLAS, which NumPy calls for ``@``, and NumPy's ``einsum`` round differently on different processors.
Results of a run must not depend on them.
"""

import numpy as np
from numpy.typing import ArrayLike


def ordered_dot(a: ArrayLike, b: ArrayLike) -> np.ndarray:
    """Return the sums of products along the last axis, added in order.

    For vectors v, w and a matrix M, ``ordered_dot(v, w)`` is v w, ``ordered_dot(M, v)`` is M v, and
    ``ordered_dot(M.T, v)`` is v M. For stacks, ``ordered_dot(M, v[:, None])``.
    """
    products = np.multiply(a, b)
    total = np.zeros(products.shape[:-1], products.dtype)
    for part in np.moveaxis(products, -1, 0):
        total = total + part
    return total
