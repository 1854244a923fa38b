"""What is not known of a fitted drive, as a spread: the covariance that `ab-sim identify` found."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from ab_sim.design.distributions import Loading
from ab_sim.design.tolerances import OFFSET, Tolerance
from ab_sim.errors import InputError

LEAST = 1e-6
"""Of a value's standard deviation: smaller parts of it are left out."""
MOST_BYTES = 50_000_000


def fitted_tolerances(path: Path) -> list[Tolerance]:
    """Of a fit's JSON, ``ab-sim identify --json``: values about the fitted ones, correlated.

    A value's deviation is a sum over independent standard normal numbers that values share: the
    covariance's triangular factor. Each number is a group, named by the key that is the first to
    depend on it, as ``fit of rotor.eccentricity``: what of this key the keys before do not tell.

    Args:
        path: the file.

    Raises:
        InputError: it cannot be read, or is no fit's; says why.
    """
    said = f"spread from {path}"
    try:
        if path.stat().st_size > MOST_BYTES:
            raise ValueError(f"has more than {MOST_BYTES} bytes")
        report = json.loads(path.read_bytes())
        names = report["covariance"]["parameters"]
        covariance = np.array(report["covariance"]["values"], float)
        common = {each["name"] for each in report["parameters"] if not each["own"]}
        kept = [k for k, name in enumerate(names) if name in common]
        factor = _factor(covariance[np.ix_(kept, kept)])
    except OSError as error:
        raise InputError(f"{said}: cannot be read: {error.strerror}") from error
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise InputError(
            f"{said}: is not what `ab-sim identify --json` writes ({type(error).__name__}: {error})"
        ) from error
    if not kept:
        raise InputError(f"{said}: nothing of the scene was fitted; there is nothing to spread")
    return [
        tolerance
        for row, k in zip(factor, kept, strict=True)
        for tolerance in _of_key(names[k], row, [names[j] for j in kept])
    ]


def _factor(covariance: np.ndarray) -> np.ndarray:
    """Lower triangular, of correlations first, which are well scaled."""
    sizes = np.sqrt(np.diag(covariance))
    if not (np.isfinite(covariance).all() and (sizes > 0.0).all()):
        raise ValueError("its covariance has numbers that no covariance has")
    correlation = covariance / np.outer(sizes, sizes)
    count = len(sizes)
    try:
        lower = np.linalg.cholesky(correlation + 1e-12 * np.eye(count))
    except np.linalg.LinAlgError as error:
        raise ValueError("its covariance is not positive definite") from error
    found: np.ndarray = lower * sizes[:, None]
    return found


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
