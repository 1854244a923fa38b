"""What derivatives of residuals tell of parameters: their covariance, and what is not told."""

import numpy as np

ROUNDING = 1e-6
"""Of the largest singular value: what differences leave of one that is 0."""
ROWS = 256
"""Of a block."""


def sum_of_squares(numbers: np.ndarray) -> float:
    """Without BLAS, see ``triangle``."""
    return float(np.square(numbers).sum())


def triangle(matrix: np.ndarray) -> np.ndarray:
    """R of a matrix Q R, up to the signs of its rows, block by block.

    BLAS shares a tall matrix among threads, which wait for each other at each of its columns: that
    took ten times as long as one thread alone, and rounds differently with each number of threads.
    Small blocks it leaves alone.

    J. Demmel, L. Grigori, M. Hoemmen and J. Langou, Communication-optimal parallel and sequential
    QR and LU factorizations, SIAM J. Sci. Comput. 34 (2012).

    Args:
        matrix: shape (rows, columns).

    Returns:
        Shape (columns, columns), or (rows, columns) of fewer rows.
    """
    left = matrix if matrix.shape[1] else matrix[:0]
    height = max(ROWS, 4 * matrix.shape[1])
    while len(left) > height:
        blocks = -(-len(left) // height)
        whole = np.zeros((blocks * height, left.shape[1]))
        whole[: len(left)] = left
        left = _r(whole.reshape(blocks, height, -1)).reshape(-1, left.shape[1])
    return _r(left)


def _r(matrices: np.ndarray) -> np.ndarray:
    found: np.ndarray = np.linalg.qr(matrices, mode="r")  # type: ignore[assignment]
    return found


def beyond(own: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """What of columns cannot be made up for by others, as a small matrix.

    Args:
        own: the others, shape (numbers, columns).
        wanted: shape (numbers, columns).
    """
    scale = np.linalg.norm(own, axis=0)
    both = np.column_stack([own / np.where(scale > 0.0, scale, 1.0), wanted])
    return triangle(both)[own.shape[1] :, own.shape[1] :]


def covariance_of(derivatives: np.ndarray) -> np.ndarray:
    """Of the parameters, in units of their scales: the inverse of J^T J.

    Where nothing tells, it is as large as rounding lets it be.

    Args:
        derivatives: J, of residuals in units of noise; shape (numbers, parameters).
    """
    size, singular, rows = _decomposed(derivatives)
    half = (rows / np.maximum(singular, ROUNDING * singular[:1])[:, None]).T / size[:, None]
    found: np.ndarray = half @ half.T
    return found


def deviations_of(derivatives: np.ndarray) -> np.ndarray:
    """Standard deviations of the parameters, in their scales; infinite where nothing tells.

    Args:
        derivatives: as of ``covariance_of``.
    """
    found = np.full(derivatives.shape[1], np.inf)
    used = np.linalg.norm(derivatives, axis=0) > 0.0
    if not used.any():
        return found
    size, singular, rows = _decomposed(derivatives[:, used])
    good = singular > ROUNDING * singular[0]
    variance = ((rows[good] / singular[good, None]) ** 2).sum(axis=0)
    # What has a part in a direction that nothing tells is not known.
    part = (rows[~good] ** 2).sum(axis=0)
    found[used] = np.where(part > ROUNDING, np.inf, np.sqrt(variance) / size)
    return found


def _decomposed(derivatives: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sizes of the columns; singular values and directions of what they are in these sizes."""
    size = np.linalg.norm(derivatives, axis=0)
    size = np.where(size > 0.0, size, 1e-300)
    _, singular, rows = np.linalg.svd(triangle(derivatives / size), full_matrices=True)
    singular = np.concatenate([singular, np.zeros(len(rows) - len(singular))])
    return size, singular, rows
