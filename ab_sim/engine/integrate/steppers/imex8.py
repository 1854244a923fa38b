"""Extrapolated Euler method of order 8 with implicit drag, for stiff drag of the race.

Euler's method runs in n = 1, 2, .. 8 equal parts and is extrapolated to infinite n. Each part
evaluates drag at its end and all else at its beginning. The balls' masses mu become mu + h c for
that, with the part's length h and the drag c, which costs one division. Any amount of drag is
stable. Without iterations and Jacobian, the step is emitted like that of an explicit method, can be
cut at events and computed in lanes.

Constantinescu and Sandu (2010), SIAM J. Sci. Comput. 31, 4452-4477: implicit-explicit
extrapolation. Deuflhard (1985), SIAM Review 27, 505-535: extrapolation of stiff systems. Hairer and
Wanner, Solving Ordinary Differential Equations II, IV.9.
"""

from typing import Any

from ab_sim.engine.integrate.registry import Stepper, register
from ab_sim.engine.kernels.runge_kutta import Extrapolation

METHOD = Extrapolation((1, 2, 3, 4, 5, 6, 7, 8))


def growth(z: Any) -> Any:
    """Return the stability function for all motions except drag."""
    pairs = zip(METHOD.divisions, METHOD.weights, strict=True)
    return sum((weight * (1 + z / n) ** n for n, weight in pairs), 0j)


_IMEX8 = register(
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
