"""Spread from the uncertainty of a fitted drive: the covariance of ``ab-sim identify``."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from ab_sim.base.errors import InputError
from ab_sim.base.files import check_regular
from ab_sim.design.distributions import Loading
from ab_sim.design.tolerances import OFFSET, Tolerance

LEAST = 1e-6
"""Components of a deviation below this fraction of the standard deviation are left out."""
MOST_BYTES = 50_000_000


def fitted_tolerances(path: Path) -> list[Tolerance]:
    """Return correlated tolerances around the fitted values of ``ab-sim identify --json``.

    A value's deviation is a sum over shared, independent standard normal numbers, weighted by the
    triangular factor of the covariance. Each number is a group named after the first key that
    depends on it, such as ``fit of rotor.eccentricity``. It is the part of this key that earlier
    keys do not explain.

    Args:
        path: file of the fit.

    Raises:
        InputError: the file cannot be read or contains no fit; the message states why.
    """
    origin = f"spread from {path}"
    try:
        check_regular(path)
        if path.stat().st_size > MOST_BYTES:
            raise ValueError(f"has more than {MOST_BYTES} bytes")
        report = json.loads(path.read_bytes())
        names = report["covariance"]["parameters"]
        covariance = np.array(report["covariance"]["values"], float)
        common = {parameter["name"] for parameter in report["parameters"] if not parameter["own"]}
        kept = [k for k, name in enumerate(names) if name in common]
        factor = _factor(covariance[np.ix_(kept, kept)])
    except OSError as error:
        raise InputError(f"{origin}: cannot be read: {error.strerror}") from error
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise InputError(
            f"{origin}: is not what `ab-sim identify --json` writes "
            f"({type(error).__name__}: {error})"
        ) from error
    if not kept:
        raise InputError(f"{origin}: nothing of the scene was fitted; there is nothing to spread")
    return [
        tolerance
        for row, k in zip(factor, kept, strict=True)
        for tolerance in _of_key(names[k], row, [names[j] for j in kept])
    ]


def _factor(covariance: np.ndarray) -> np.ndarray:
    """Return the lower triangular factor, computed from correlations, which are well scaled."""
    sizes = np.sqrt(np.diag(covariance))
    if not (np.isfinite(covariance).all() and (sizes > 0.0).all()):
        raise ValueError("its covariance is not finite, or has a variance that is not above 0")
    correlation = covariance / np.outer(sizes, sizes)
    count = len(sizes)
    try:
        lower = np.linalg.cholesky(correlation + 1e-12 * np.eye(count))
    except np.linalg.LinAlgError as error:
        raise ValueError("its covariance is not positive definite") from error
    factor: np.ndarray = lower * sizes[:, None]
    return factor


def _of_key(key: Any, row: np.ndarray, keys: list[Any]) -> list[Tolerance]:
    whole = math.sqrt(float(row @ row))
    return [
        Tolerance(
            str(key), OFFSET, Loading(float(size)), (), False, f"fit of {first}",
            f"{key} as fitted, with {first}",
        )
        for first, size in zip(keys, row, strict=True)
        if abs(size) > LEAST * whole
    ]  # fmt: skip
