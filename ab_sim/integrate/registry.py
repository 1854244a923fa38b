"""The steppers that a scene can name."""

from ab_sim.errors import SceneError, nearest
from ab_sim.integrate.rk4 import RK4
from ab_sim.integrate.rk8 import RK8
from ab_sim.integrate.sweeps import SWEEPS, Sweeps
from ab_sim.integrate.tableau import Tableau
from ab_sim.integrate.tsit5 import TSIT5

Stepper = Tableau | Sweeps

STEPPERS: dict[str, Stepper] = {stepper.name: stepper for stepper in (RK4, TSIT5, RK8, SWEEPS)}
AUTO = "auto"
"""What a scene names to leave the choice open."""


def stepper_named(name: str) -> Stepper:
    """The stepper of that name.

    Raises:
        SceneError: unknown; names the known ones and the nearest.
    """
    if name in STEPPERS:
        return STEPPERS[name]
    raise SceneError(
        f"solver.stepper = {name!r}: no such stepper{nearest(name, [*STEPPERS, AUTO])}; known are: "
        + ", ".join([*STEPPERS, AUTO])
    )
