"""Taylor coefficients of a motion, as expressions, from a model's equations by recurrences.

The equations of motion are not solved for the accelerations symbolically. At each order they are
linear in the accelerations' coefficients of that order, with the mass matrix at the step's
beginning. ``arrowhead.solve`` solves them, and its elimination is shared by all orders. So no
series of an inverse is needed, only one product of series per term.
"""

from collections.abc import Sequence

from ab_sim.engine.kernels.model import OF_EACH_BALL, Evaluated, Model
from ab_sim.model.equations.arrowhead import Arrow, Solved, solve
from ab_sim.model.equations.sums import Number, over_balls
from ab_sim.tracing import Expression
from ab_sim.tracing.derivatives import PowerSeries, derivatives
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
    moving = {**rates, **equations.moment_rates, model.lifted(at.time): model.graph.constant(1.0)}
    series = PowerSeries(moving, [equations.at_zero, *equations.force])
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
        at, n = model.motion(), model.count
        spindle, torques, on, arrow = model.arrow(at)
        free, al = model.unknowns - 1, spindle.acceleration
        self._x = [graph.input(f"x[{r}]") for r in range(free)]
        self._path = graph.input("path", per_ball=True)
        x = [*self._x, lifted(al)]
        self.unsolved = Evaluated(spindle, torques, on, arrow, Solved(x, self._path))
        """Equations of motion at a state, not yet solved for the accelerations."""
        self._block = [
            [lifted(arrow.block[min(r, q)][max(r, q)]) for q in range(free)] for r in range(free)
        ]
        self._coupling = [lifted(entry) for entry in arrow.coupling[:free]]
        pull = arrow.path_force
        for coupling, acceleration in zip(arrow.coupling, x, strict=True):
            pull = pull + coupling * acceleration
        self.at_zero = lifted(model.mobility(pull))
        """Path accelerations of the balls; their coefficient k without that of the x's."""
        self.moment_rates: dict[Expression, Expression] = {}
        """Rates of the sums of the balls' moments, by the inputs that stand for the sums."""
        self._moments: list[Expression] = []
        force: Sequence[Number] = arrow.force
        if n and hasattr(model.deck, "ball_moment"):
            # The balls' reaction on the deck is -(P'' + 2 w J P' - w^2 P + al J P), P the sum of
            # their moments. P'' costs no product of series, unlike the forces and path
            # accelerations that it consists of, and the other terms one for all balls.
            self._moments = [lifted(over_balls(n, m)) for m in model.deck.ball_moment(on)]
            theta, rate = (graph.input(name, per_ball=True) for name in OF_EACH_BALL)
            moments = [graph.input(f"moment[{r}]") for r in range(2)]
            rates = derivatives(self._moments, {theta: rate})
            self.moment_rates = dict(zip(moments, rates, strict=True))
            w, (p1, p2), (dp1, dp2) = spindle.speed, moments, rates
            f1, f2 = model.deck.free_force(model.effects, spindle, at.deck)
            force = [
                f1 + w * w * p1 + (w + w) * dp2 + al * p2,
                f2 + w * w * p2 - (w + w) * dp1 - al * p1 - model.deck.unbalance * al,
            ]
        else:
            force = [
                f - arrow.block[r][free] * al + over_balls(n, coupling * self._path)
                for r, (f, coupling) in enumerate(zip(force[:free], self._coupling, strict=True))
            ]
        self.force = []
        """Forces on deck and spindle; their coefficient k without that of the unknowns."""
        for f, row in zip(force, self._block, strict=False):
            for entry, acceleration in zip(row, self._x, strict=True):
                f = f - entry * acceleration
            self.force.append(lifted(f))

    def solve(self, series: PowerSeries, k: int) -> None:
        """Solve for coefficient k of the accelerations; the lower ones are known."""
        model, of, n = self._model, series.coefficient, self._model.count
        if k == 0:
            for moment, value in zip(self.moment_rates, self._moments, strict=True):
                series.give(moment, 0, of(value, 0))
            self._invert(series)
        # Cauchy products: the unknown b_k is multiplied by a_0 only, so all other terms go to the
        # right-hand side and the matrix is that of order 0.
        ahead = series.without([*self._x, self._path], k)
        at_zero = ahead.coefficient(self.at_zero, k)
        force = [ahead.coefficient(f, k) for f in self.force]
        for r, rate in enumerate(self.moment_rates.values()):
            force[r] = force[r] - float(k + 1) * ahead.coefficient(rate, k + 1)
        for r, coupling in enumerate(self._coupling):
            force[r] = force[r] + over_balls(n, of(coupling, 0) * at_zero)
        for x, row in zip(self._x, self._inverse, strict=True):
            series.give(x, k, model.lifted(_dot(row, force)))
        series.give(self._path, k, model.lifted(_dot(self._gain, force, at_zero)))

    def _invert(self, series: PowerSeries) -> None:
        """Invert the reduced matrix; compute how the balls' accelerations follow from forces."""
        model, of = self._model, series.coefficient
        block: list[list[Number]] = [[of(entry, 0) for entry in row] for row in self._block]
        coupling: list[Number] = [of(entry, 0) for entry in self._coupling]
        units = [[float(r == q) for q in range(len(block))] for r in range(len(block))]
        arrows = (Arrow(block, [*unit], coupling, coupling, 0.0, 0.0) for unit in units)
        self._inverse = [solve(arrow, model.count, model.mobility).x for arrow in arrows]
        gain = [model.mobility(entry) for entry in coupling]
        self._gain = [_dot(gain, row) for row in self._inverse]


def _dot(a: Sequence[Number], b: Sequence[Number], total: Number = 0.0) -> Number:
    """Return ``total`` plus the products of two lists."""
    for one, other in zip(a, b, strict=True):
        total = total + one * other
    return total
