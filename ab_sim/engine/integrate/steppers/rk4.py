"""Classical Runge-Kutta method of order 4."""

from ab_sim.engine.integrate.explicit import explicit
from ab_sim.engine.integrate.registry import register

_RK4 = register(
    explicit(
        name="rk4",
        order=4,
        source="Kutta (1901)",
        rows=[[1 / 2], [0, 1 / 2], [0, 0, 1]],
        weights=[1 / 6, 1 / 3, 1 / 3, 1 / 6],
    )
)
