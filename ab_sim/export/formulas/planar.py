"""Print the equations of motion of a deck in the plane of the disc, as planar.py computes them.

One placeholder stands for all effects. Each of its methods returns a symbol, so the lines show
where an effect acts. The formulas of the effects are printed separately.
"""

from typing import Any, NamedTuple

from ab_sim.export.formulas.lines import Equation, Lines, Symbols, lines_of
from ab_sim.model.equations.arrowhead import Arrow, normal_force
from ab_sim.model.equations.motion import (
    Ball,
    BallConstants,
    DeckMotion,
    OnRace,
    SpindleMotion,
    on_race,
    rate_change,
)
from ab_sim.model.equations.planar import Planar
from ab_sim.model.equations.sums import over_balls
from ab_sim.tracing.expression import Graph
from ab_sim.tracing.functions import cos, sin
from ab_sim.tracing.printed import Named, with_local_names

_NAMED = {
    "load": "load",
    "along": "along",
    "b13": "b_13",
    "b23": "b_23",
    "spin_mass": "spin_mass",
    "inertia": "inertia",
    "lever": "lever",
    "h": "h",
    "curve": "l",
    "path": "s'",
    "g1": "gravity_1",
    "g2": "gravity_2",
    "N": "N",
}
"""Symbols of the intermediate quantities that are named; others are written out."""
_EXPLAINED = frozenset({"h", "l"})
"""Symbols that the formulas of effects define, so that this page does not define them again."""


class TracedEffect(NamedTuple):
    """Placeholder for all effects."""

    x: Symbols

    def deck_force(self, deck: DeckMotion) -> tuple[Any, Any]:
        """Return the symbols of the force on the deck."""
        return self.x("f_1"), self.x("f_2")

    def gravity(self) -> tuple[Any, Any]:
        """Return the symbols of gravity across the shaft."""
        return self.x("g_x"), self.x("g_y")

    def race_shape(self, c: Any, s: Any) -> tuple[Any, ...]:
        """Return the symbols of the shape of a race, relative to a circle."""
        per_ball = self.x.each
        return (
            per_ball("h") - per_ball("R"),
            per_ball("x"),
            per_ball("l") - per_ball("R"),
            per_ball("dl/dtheta"),
        )

    def ball_inertia(self, ball: Ball) -> Any:
        """Return the symbol of the additional inertia of rolling balls."""
        return self.x.each("I") / (ball.radius * ball.radius)

    def ball_drag(self, ball: Ball) -> Any:
        """Return the symbol of the drag coefficient of a ball."""
        return self.x("c_b")

    def rotor_moment(self) -> Any:
        """Return the symbol of the rotor's moment of inertia."""
        return self.x("I_r")


class EquationGroup(NamedTuple):
    """Equations under one title."""

    title: str
    lines: Lines


def planar_sections() -> list[EquationGroup]:
    """Return the equations of deck, spindle and balls in groups."""
    system = _System(Symbols(Graph()))
    return [
        EquationGroup("displacement and velocity", system.rates()),
        EquationGroup("deck and spindle", system.deck()),
        EquationGroup("each ball", system.balls()),
    ]


class _System:
    """Equations of motion as expressions of symbols."""

    def __init__(self, x: Symbols) -> None:
        per_ball, theta = x.each, x.each("theta")
        m, radius, R = per_ball("m"), per_ball("a"), per_ball("R")
        inertia = per_ball("I") / (radius * radius)
        self.x, self.mu = x, per_ball("mu")
        constants = BallConstants(
            *(2, m, radius, self.mu, 1.0 / self.mu, m * R, m * R - inertia * radius),
            *(R, 1.0 / R, per_ball("z")),
        )
        self.spindle = SpindleMotion(x("w"), x("al"), cos(x("psi")), sin(x("psi")), x("T"), x("z'"))
        self.effects = (TracedEffect(x),)
        self.state = [x("u_1"), x("u_2"), x("v_1"), x("v_2")]
        self.accelerations = [x("A_1"), x("A_2"), x("al")]
        self.path = per_ball("s''")
        unbalance = x("M0") * x("e")
        self.planar = Planar._make([x("M"), unbalance, x("e"), x("sag_x"), x("sag_y")])

        def equations() -> tuple[OnRace, Arrow]:
            on = on_race(self.effects, constants, cos(theta), sin(theta), per_ball("theta'"))
            return on, self.planar.arrow(self.effects, constants, on, self.spindle, self.state)

        (self.on, self.arrow), self.named = with_local_names(equations)

    def rates(self) -> Lines:
        """Return the rates of displacement and velocity."""
        rates, named = with_local_names(
            self.planar.rates, self.effects, self.spindle, self.state, self.accelerations
        )
        symbols = ("u_1'", "u_2'", "v_1'", "v_2'")
        left_sides = [self.x(symbol) for symbol in symbols]
        sides = zip(left_sides, rates, strict=True)
        return self._lines([Equation(*side) for side in sides], named, set())

    def deck(self) -> Lines:
        """Return the equations of deck and spindle: B x - sum_i coupling_i g_i = F."""
        equations = []
        for r, force in enumerate(self.arrow.force):
            left_side = -over_balls(2, self.arrow.coupling[r] * self.path)
            for q, acceleration in reversed(list(enumerate(self.accelerations))):
                left_side = self.arrow.block[min(r, q)][max(r, q)] * acceleration + left_side
            equations.append(Equation(left_side, force))
        return self._lines(equations, self.named, set())

    def balls(self) -> Lines:
        """Return the equation of a ball along the race: mu g = path_force + coupling.x - nu N."""
        N = normal_force(self.arrow, self.accelerations)
        force = self.arrow.path_force
        for coupling, acceleration in zip(self.arrow.coupling, self.accelerations, strict=True):
            force = force + coupling * acceleration
        force = force - self.x.each("nu") * N
        angle = rate_change(self.on, self.path)
        equations = [
            Equation(self.mu * self.path, force),
            Equation(self.x.each("theta''"), angle),
        ]
        before = {"spin_mass", "lever", "s'", "load", "along"}
        return self._lines(equations, [*self.named, Named("N", N)], before)

    def _lines(self, equations: list[Equation], named: list[Named], before: set[str]) -> Lines:
        named_here = [one for one in named if one.name in _NAMED]
        return lines_of(equations, named_here, _NAMED, _EXPLAINED | before, always=True)
