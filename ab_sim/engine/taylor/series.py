"""Taylor coefficients of a motion, as expressions, from a model's equations by recurrences.

The equations of motion are not solved for the accelerations symbolically. At each order they are
linear in the accelerations' coefficients of that order, with the mass matrix at the step's
beginning. ``arrowhead.solve`` solves them, and its elimination is shared by all orders. So no
series of an inverse is needed, only one product of series per term.
"""

from collections.abc import Sequence

from ab_sim.engine.kernels.model import Evaluated, Model
from ab_sim.model.equations.arrowhead import Arrow, Solved, solve
from ab_sim.model.equations.sums import Number, over_balls
from ab_sim.tracing import Expression
from ab_sim.tracing.derivatives import PowerSeries
from ab_sim.tracing.expression import is_constant


def state_coefficients(model: Model, order: int) -> list[list[Expression]]:
    """Return coefficients 0 to ``order`` of each state, in the states' order.

    A state that each ball has is one expression for all balls.

    Parameters
    ----------
    model
        Model without events.
    order
        Order of the series.

    Raises
    ------
    NotAnalyticError
        A formula has no Taylor series.
    """
    at = model.motion()
    equations = _Equations(model)
    rates = dict(zip(model.state_inputs(), model.slope(at, equations.unsolved), strict=True))
    series = PowerSeries({**rates, model.lifted(at.time): model.graph.constant(1.0)})
    coefficients_of: list[list[Expression]] = [[] for _ in rates]
    for k in range(order + 1):
        for coefficients, state in zip(coefficients_of, rates, strict=True):
            coefficients.append(series.coefficient(state, k))
        if k < order:
            equations.solve(series, k)
    return coefficients_of


_MM = 1e-3
"""Millimetre [m]."""


def squared_size(model: Model, coefficients: Sequence[Sequence[Expression]], k: int) -> Expression:
    """Return the squared norm of coefficient k, over balls' angles and the deck's position.

    The deck's displacement is divided by the race's radius, or by 1 mm without balls. Its rotations
    are not scaled.

    Parameters
    ----------
    model
        See ``state_coefficients``.
    coefficients
        Result of ``state_coefficients``.
    k
        Order of the coefficient.
    """
    n = model.count
    length = n / over_balls(n, model.balls.race_curvature) if n else _MM
    # At speed 0 only displacements and rotations have a scale other than 0.
    scales = model.deck.scale(length, 0.0)
    angles = coefficients[model.states][k]
    size = over_balls(n, angles * angles)
    for series, scale in zip(coefficients, scales, strict=False):
        if not is_constant(model.lifted(scale), 0.0):
            part = series[k] * (1.0 / scale)
            size = size + part * part
    return model.lifted(size)


class _Equations:
    """Equations of motion in which the accelerations are unknown series."""

    def __init__(self, model: Model) -> None:
        self._model, graph, lifted = model, model.graph, model.lifted
        at = model.motion()
        spindle, torques, on, arrow = model.arrow(at)
        free, al = model.unknowns - 1, spindle.acceleration
        self._x = [graph.input(f"x[{r}]") for r in range(free)]
        self._path = graph.input("path", per_ball=True)
        x = [*self._x, lifted(al)]
        self.unsolved = Evaluated(spindle, torques, on, arrow, Solved(x, self._path))
        """Equations at a state, before they are solved for the accelerations."""
        self._block = [
            [lifted(arrow.block[min(r, q)][max(r, q)]) for q in range(free)] for r in range(free)
        ]
        self._coupling = [lifted(entry) for entry in arrow.coupling[:free]]
        force: Sequence[Number] = arrow.force
        self._moment: list[Expression] = []
        self._moment_rate: list[Expression] = []
        if model.count and hasattr(model.deck, "ball_moment"):
            # The balls' reaction on the deck is -(P'' + 2 w J P' - w^2 P + al J P), P the sum of
            # their moments. P'' costs no product of series, unlike the forces and path
            # accelerations that it consists of, and the other terms one for all balls.
            w, (one, two) = spindle.speed, model.deck.ball_moment(on)
            self._moment = [lifted(over_balls(model.count, m)) for m in (one, two)]
            self._moment_rate = [graph.input(f"moment_rate[{r}]") for r in range(2)]
            (p1, p2), (dp1, dp2) = self._moment, self._moment_rate
            f1, f2 = model.deck.free_force(model.effects, spindle, at.deck)
            force = [f1 + w * w * p1 + 2.0 * w * dp2, f2 + w * w * p2 - 2.0 * w * dp1]
        self._force = [lifted(force[r] - arrow.block[r][free] * al) for r in range(free)]
        self._path_force = lifted(arrow.path_force + arrow.coupling[free] * al)

    def solve(self, series: PowerSeries, k: int) -> None:
        """Solve for coefficient k of the accelerations; the lower ones are known."""
        model, of = self._model, series.coefficient
        zero = model.graph.constant(0.0)

        def without_unknown(a: Expression, b: Expression) -> Expression:
            """Return coefficient k of the product a b without the term a_0 b_k."""
            return series.product(a, b, k, 1) if k else zero

        # Cauchy products: the unknown b_k is multiplied by a_0 only, so all other terms go to the
        # right-hand side and the matrix is that of order 0.
        force: list[Number] = []
        for moment, rate in zip(self._moment, self._moment_rate, strict=True):
            series.give(rate, k, series.change(moment, k))
        known_moments: list[Expression] = []
        if self._moment:
            ahead = series.without(self._path, k)
            known_moments = [ahead.coefficient(moment, k + 2) for moment in self._moment]
        for r, row in enumerate(self._block):
            total = of(self._force[r], k)
            for entry, x in zip(row, self._x, strict=True):
                total = total - without_unknown(entry, x)
            if known_moments:
                total = total - float((k + 2) * (k + 1)) * known_moments[r]
            else:
                total = total + over_balls(
                    model.count, without_unknown(self._coupling[r], self._path)
                )
            force.append(total)
        path_force = of(self._path_force, k)
        for coupling, x in zip(self._coupling, self._x, strict=True):
            path_force = path_force + without_unknown(coupling, x)
        first: list[list[Number]] = [[of(entry, 0) for entry in row] for row in self._block]
        couplings: list[Number] = [of(entry, 0) for entry in self._coupling]
        arrow = Arrow(first, force, couplings, couplings, 0.0, path_force)
        solved = solve(arrow, model.count, model.mobility)
        for x, value in zip(self._x, solved.x, strict=True):
            series.give(x, k, model.lifted(value))
        series.give(self._path, k, model.lifted(solved.path))
