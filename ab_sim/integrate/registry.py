"""The steppers that a scene can name."""

from ab_sim.errors import SceneError, nearest
from ab_sim.integrate.rk4 import RK4
from ab_sim.integrate.rk8 import RK8
from ab_sim.integrate.tableau import Tableau
from ab_sim.integrate.tsit5 import TSIT5

STEPPERS = {tableau.name: tableau for tableau in (RK4, TSIT5, RK8)}


def stepper_named(name: str) -> Tableau:
    """The stepper of that name.

    Raises:
        SceneError: unknown; names the known ones and the nearest.
    """
    if name in STEPPERS:
        return STEPPERS[name]
    raise SceneError(
        f"solver.stepper = {name!r}: no such stepper{nearest(name, STEPPERS)}; known are: "
        + ", ".join(STEPPERS)
    )
