"""Extrapolated Euler of order 8 that takes the race's drag implicitly, and all else explicitly.

Euler's method in n = 1, 2, .. 8 equal parts, extrapolated to infinitely many. In each part the drag
is that at the part's end: the masses in the equations of the balls become mu + h c, which costs one
division, and any amount of drag is stable. Nothing is iterated and there is no Jacobian, so that
the step is emitted as that of an explicit method, is cut at events, and goes in lanes.

Constantinescu and Sandu (2010), SIAM J. Sci. Comput. 31, 4452-4477: implicit-explicit
extrapolation; Deuflhard (1985), SIAM Review 27, 505-535: where it is stiff; Hairer and Wanner,
Solving Ordinary Differential Equations II, IV.9.
"""

from ab_sim.integrate.registry import register
from ab_sim.integrate.stepper import Stepper
from ab_sim.kernels.runge_kutta import Extrapolation

METHOD = Extrapolation((1, 2, 3, 4, 5, 6, 7, 8))


def growth(z: complex) -> complex:
    """What a step makes of all but the drag."""
    pairs = zip(METHOD.divisions, METHOD.weights, strict=True)
    return sum((weight * (1 + z / n) ** n for n, weight in pairs), 0j)


IMEX8 = register(
    Stepper(
        name="imex8",
        order=8,
        source="Constantinescu and Sandu (2010), SIAM J. Sci. Comput. 31, 4452-4477",
        weights=METHOD,
        evaluations=sum(METHOD.divisions),
        growth=growth,
        solves_drag=True,
        takes_lanes=True,
    )
)
