"""Longest step with which a stepper is stable."""

import cmath
import functools
import math
from collections.abc import Mapping

import numpy as np

from ab_sim.base.errors import SceneError, exact
from ab_sim.engine.integrate.stepper import Stepper

TOLERANCE = 1e-3
"""Growth per step that counts as stable, since methods amplify undamped motion slightly."""
REACHES = np.concatenate([0.01 * np.arange(1, 5001), 50.0 * 2.0 ** np.arange(1, 31)])
"""Values of |z| at which growth is examined; a method stable at all of them has no limit."""


@functools.lru_cache(maxsize=1000)
def stability_limit(stepper: Stepper, direction: complex = -1.0) -> float:
    """Return the extent of a stepper's stability region from 0 in a direction.

    Args:
        stepper: method.
        direction: complex number of modulus 1; -1 is the negative real axis, for decay, and +-1j
            the imaginary axis, for undamped motion.

    Returns:
        Largest x for which one step does not amplify y' = (x direction / step) y; infinite for a
        method that never amplifies it.
    """
    tolerance = 0.0 if direction == -1.0 else TOLERANCE

    def unstable(x: float) -> bool:
        return abs(stepper.growth(x * direction)) > 1.0 + tolerance

    # The first unstable point ends the interval of stability that begins at 0; bisection between
    # it and the last stable point gives the limit. Stable points beyond it do not count.
    inside = outside = 0.0
    for outside in REACHES.tolist():
        if unstable(outside):
            break
        inside = outside
    else:
        return math.inf
    for _ in range(50):
        middle = 0.5 * (inside + outside)
        inside, outside = (inside, middle) if unstable(middle) else (middle, outside)
    return inside * stepper.parts


def largest_step(stepper: Stepper, rates: Mapping[str, complex]) -> tuple[float, str]:
    """Return the longest stable step [s], rounded down to three digits, and its cause.

    Args:
        stepper: method.
        rates: eigenvalues [1/s] by the names of their motions; zeros do not limit the step.

    Returns:
        The step and the name of the motion that limits it; infinity and an empty string if none
        does.
    """
    steps = {
        what: stability_limit(stepper, _direction(rate)) / abs(rate)
        for what, rate in rates.items()
        if rate != 0
    }
    what = min(steps, key=lambda key: steps[key], default="")
    if math.isinf(steps.get(what, math.inf)):
        return math.inf, ""
    digits = 2 - math.floor(math.log10(steps[what]))
    return math.floor(steps[what] * 10.0**digits) / 10.0**digits, what


def check_step(
    stepper: Stepper, step: float, rates: Mapping[str, complex], limit: tuple[float, str]
) -> None:
    """Refuse a step that is beyond the stability limit.

    Args:
        stepper: method.
        step: length of the step [s].
        rates: eigenvalues [1/s] by the names of their motions.
        limit: ``largest_step`` of the method and these rates.

    Raises:
        SceneError: the step is too long; the message names the limit and its cause.
    """
    largest, what = limit
    if step <= largest:
        return
    advice = f"with {stepper.name} use at most {largest:g} s"
    if largest < 1e-8:
        advice = f"no {stepper.name} step of useful length is stable: lower the rate"
    raise SceneError(
        f"solver.step = {exact(step)} s: is beyond the stability limit of {what}, whose rate is "
        f"{abs(rates[what]):.4g} 1/s; {advice}"
    )


def _direction(rate: complex) -> complex:
    # Rounded, so that the cache serves nearly equal directions.
    return cmath.rect(1.0, round(cmath.phase(rate), 3)) if rate.imag else -1.0
