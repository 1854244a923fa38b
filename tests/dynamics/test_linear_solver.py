"""Elimination within a kernel, beside LAPACK."""

import numba
import numpy as np
import pytest

from ab_sim.dynamics.linear_solver import reduce


@numba.njit
def reduced(table: np.ndarray, size: int, columns: int) -> None:
    reduce(table, size, columns)


@pytest.mark.parametrize("size", [1, 2, 4, 8, 12])
def test_solutions_are_lapacks(size: int) -> None:
    random = np.random.default_rng(size)
    table = np.full((size + 1, size + 5), 7.0)
    matrix, right = random.normal(size=(size, size)), random.normal(size=(size, 3))
    if size > 1:
        matrix[0, 0] = 0.0  # rows have to change places
    table[:size, :size], table[:size, size : size + 3] = matrix, right
    reduced(table, size, size + 3)
    want = np.linalg.solve(matrix, right)
    np.testing.assert_allclose(table[:size, size : size + 3], want, rtol=1e-10, atol=1e-12)
    assert (table[size] == 7.0).all() and (table[:, size + 3 :] == 7.0).all()


def test_a_row_of_another_size_loses_no_digits() -> None:
    """What a stiff drag makes: one equation 1e12 times as large as the others."""
    matrix = np.array([[1.0, 2.0, 3.0], [2e12, -1e12, 1e12], [1.0, 0.5, -1.0]])
    table = np.column_stack([matrix, matrix @ [1.0, 2.0, 3.0]])
    reduced(table, 3, 4)
    np.testing.assert_allclose(table[:, 3], [1.0, 2.0, 3.0], rtol=1e-13)
