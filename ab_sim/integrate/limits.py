"""How long a step may be before a stepper goes unstable."""

import cmath
import functools
import math
from collections.abc import Mapping

import numpy as np

from ab_sim.errors import SceneError, exact
from ab_sim.integrate.stepper import Stepper

TOLERANCE = 1e-3
"""Growth per step that still counts as stable: methods amplify undamped motion a little."""
REACHES = np.concatenate([0.01 * np.arange(1, 5001), 50.0 * 2.0 ** np.arange(1, 31)])
"""Where growth is looked at; a method that is stable at all of these has no limit."""


@functools.lru_cache(maxsize=1000)
def stability_limit(stepper: Stepper, direction: complex = -1.0) -> float:
    """How far the stability region of a stepper reaches from 0.

    Args:
        stepper: the method.
        direction: of modulus 1; -1 is the negative real axis, decay, and +-1j undamped motion.

    Returns:
        Largest x for which one step does not amplify y' = (x direction / step) y; infinite for a
        method that never does.
    """
    tolerance = 0.0 if direction == -1.0 else TOLERANCE

    def unstable(x: float) -> bool:
        return abs(stepper.growth(x * direction)) > 1.0 + tolerance

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
    """The longest stable step [s], rounded down to three digits, and what limits it.

    Args:
        stepper: the method.
        rates: eigenvalues [1/s] by what they belong to; those of 0 do not limit the step.

    Returns:
        Infinite, and an empty string, where nothing limits it.
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
        stepper: the method.
        step: s.
        rates: eigenvalues [1/s] by what they belong to.
        limit: their ``largest_step``.

    Raises:
        SceneError: names what limits the step, and the largest allowed one.
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
