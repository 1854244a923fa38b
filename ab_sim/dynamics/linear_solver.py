"""Small dense linear systems within a kernel.

LAPACK, as numba calls it, copies and allocates for every call: for four equations that is most of
a step's time.
"""

import numba

from ab_sim.dynamics.dispatch import APART


@numba.njit(**APART)
def reduce(table, size, columns):  # type: ignore[no-untyped-def]
    """Gauss and Jordan's elimination with partial pivoting, in place.

    Args:
        table: the matrix, and right-hand sides in the columns behind it, which hold the solutions
            at the end; contiguous, and no smaller than (size, columns).
        size: how many equations there are.
        columns: of matrix and right-hand sides together.
    """
    for p in range(size):
        best = p
        for r in range(p + 1, size):
            if abs(table[r, p]) > abs(table[best, p]):
                best = r
        scale = 1.0 / table[best, p]
        for c in range(p, columns):
            moved = table[best, c] * scale
            table[best, c] = table[p, c]
            table[p, c] = moved
        for r in range(size):
            factor = table[r, p]
            if r != p and factor != 0.0:
                for c in range(p, columns):
                    table[r, c] -= factor * table[p, c]
