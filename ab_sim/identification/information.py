"""Information about parameters in the derivatives of residuals: covariance and rank."""

import numpy as np

ROUNDING = 1e-6
"""Relative size of singular values that are 0 up to the error of finite differences."""
ROWS = 256
"""Least number of rows of a block."""


def sum_of_squares(numbers: np.ndarray) -> float:
    """Return the sum of squares without BLAS, see ``triangle``."""
    return float(np.square(numbers).sum())


def triangle(matrix: np.ndarray) -> np.ndarray:
    """Return R of the QR decomposition, up to the signs of its rows, block by block.

    BLAS distributes a tall matrix over threads, which synchronise at every column. This took ten
    times as long as a single thread, and the rounding depends on the number of threads. Small
    blocks stay on one thread.

    J. Demmel, L. Grigori, M. Hoemmen and J. Langou, Communication-optimal parallel and sequential
    QR and LU factorizations, SIAM J. Sci. Comput. 34 (2012).

    Parameters
    ----------
    matrix
        Matrix, shape (rows, columns).

    Returns
    -------
    np.ndarray
        R, shape (columns, columns), or (rows, columns) if there are fewer rows.
    """
    rest = matrix if matrix.shape[1] else matrix[:0]
    height = max(ROWS, 4 * matrix.shape[1])
    while len(rest) > height:
        blocks = -(-len(rest) // height)
        whole = np.zeros((blocks * height, rest.shape[1]))
        whole[: len(rest)] = rest
        rest = _r(whole.reshape(blocks, height, -1)).reshape(-1, rest.shape[1])
    return _r(rest)


def _r(matrices: np.ndarray) -> np.ndarray:
    """Return R of the QR decomposition of each matrix, shape (..., rows, columns)."""
    factor: np.ndarray = np.linalg.qr(matrices, mode="r")  # type: ignore[assignment]
    return factor


def beyond(fixed: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Return a small matrix of the part of columns that other columns cannot reproduce.

    It is the triangular factor of ``wanted`` after projection onto the orthogonal complement of
    ``fixed``.

    Parameters
    ----------
    fixed
        Other columns, shape (rows, fixed columns).
    wanted
        Columns of interest, shape (rows, wanted columns).

    Returns
    -------
    np.ndarray
        Triangular factor, shape (wanted columns, wanted columns) or with fewer rows.
    """
    scale = np.linalg.norm(fixed, axis=0)
    both = np.column_stack([fixed / np.where(scale > 0.0, scale, 1.0), wanted])
    return triangle(both)[fixed.shape[1] :, fixed.shape[1] :]


def covariance_of(derivatives: np.ndarray, most: float = np.inf) -> np.ndarray:
    """Return the covariance of the parameters (inverse of J^T J), each in units of its scale.

    Along unidentifiable directions it is limited by rounding.

    Parameters
    ----------
    derivatives
        Jacobian J of residuals in units of noise, shape (residuals, parameters).
    most
        Standard deviation in units of the scales above which a direction is left out.
    """
    size, singular, rows = _decomposed(derivatives)
    half = (rows / np.maximum(singular, ROUNDING * singular[:1])[:, None]).T / size[:, None]
    half = half[:, np.abs(half).max(axis=0) <= most]
    covariance: np.ndarray = half @ half.T
    return covariance


def deviations_of(derivatives: np.ndarray) -> np.ndarray:
    """Return standard deviations of parameters in units of their scales; inf if unidentifiable.

    Parameters
    ----------
    derivatives
        See ``covariance_of``.
    """
    deviations = np.full(derivatives.shape[1], np.inf)
    used = np.linalg.norm(derivatives, axis=0) > 0.0
    if not used.any():
        return deviations
    size, singular, rows = _decomposed(derivatives[:, used])
    good = singular > ROUNDING * singular[0]
    variance = ((rows[good] / singular[good, None]) ** 2).sum(axis=0)
    # A parameter with a component along an unidentifiable direction is unknown.
    part = (rows[~good] ** 2).sum(axis=0)
    deviations[used] = np.where(part > ROUNDING, np.inf, np.sqrt(variance) / size)
    return deviations


def _decomposed(derivatives: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return column norms, and singular values and right singular vectors of normalised columns.

    Normalisation makes the rank independent of the parameters' scales. The vectors are rows, shape
    (parameters, parameters); those of unidentifiable directions come last.
    """
    size = np.linalg.norm(derivatives, axis=0)
    size = np.where(size > 0.0, size, 1e-300)
    _, singular, rows = np.linalg.svd(triangle(derivatives / size), full_matrices=True)
    singular = np.concatenate([singular, np.zeros(len(rows) - len(singular))])
    return size, singular, rows
