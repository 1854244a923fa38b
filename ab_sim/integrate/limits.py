"""How long a step may be before an explicit stepper goes unstable."""

import functools
import math

import numpy as np

from ab_sim.errors import SceneError
from ab_sim.integrate.registry import stepper_named
from ab_sim.integrate.tableau import Tableau


@functools.cache
def real_stability_limit(name: str) -> float:
    """Largest x for which the stepper called ``name`` does not amplify y' = -(x/step) y."""
    tableau = stepper_named(name)
    inside, outside = 0.0, math.inf
    for x in np.arange(0.01, 50.0, 0.01):
        if abs(tableau.growth(-x)) > 1.0:
            outside = float(x)
            break
        inside = float(x)
    for _ in range(50):
        middle = 0.5 * (inside + outside)
        if abs(tableau.growth(-middle)) > 1.0:
            outside = middle
        else:
            inside = middle
    return inside


def check_step(tableau: Tableau, step: float, rate: float) -> None:
    """Refuse a step that is beyond the stability limit of the scene's drag.

    Args:
        tableau: the stepper.
        step: s.
        rate: fastest decay rate of a ball's speed along the race [1/s].

    Raises:
        SceneError: names the largest allowed step.
    """
    limit = real_stability_limit(tableau.name)
    if step * rate <= limit:
        return
    largest = limit / rate
    # Rounded down, so that the step that the message names is accepted.
    digits = 2 - math.floor(math.log10(largest))
    largest = math.floor(largest * 10**digits) / 10**digits
    raise SceneError(
        f"solver.step = {step:g} s: is beyond the stability limit of the race's drag, whose decay "
        f"rate is {rate:.4g} 1/s; with {tableau.name} use at most {largest:g} s"
    )
