"""What collocation computes at the nodes of a step, as expressions: one lane for each node.

Equations of second order are x'' + c x' + k x = f: of the deck's coordinates first, then of the
balls, and of a motor's spindle. Unknown is f at the nodes. What it makes of x and v is linear, and
as exact as the tables of responses; how accelerations follow from x and v, the model says. An
iteration goes round once: the deck gives way to the balls' accelerations as they were, and each
ball follows the deck: no elimination, no division, and a change shrinks by 1/70 or so.
"""

from collections.abc import Sequence
from typing import NamedTuple

from ab_sim.collocation.coordinates import Axes, Coordinates, DeckModes, DeckPlace, Vector
from ab_sim.equations.arrowhead import Arrow, Solved, solve_with_balls
from ab_sim.equations.energy import powers
from ab_sim.equations.motion import SpindleMotion
from ab_sim.equations.race import path_acceleration, rate_change
from ab_sim.equations.spindle import MotorState
from ab_sim.equations.sums import Number
from ab_sim.kernels.model import Model, TracedState
from ab_sim.tracing import Expression, Level, cos, sin, total
from ab_sim.tracing.expression import fma, lifted
from ab_sim.tracing.functions import across, lane

CHAINS = 4
"""Sums of a product's terms that are made side by side, where it is made alone."""
ACCUMULATORS = 16
"""Vectors of eight numbers in which sums are made at the same time: half of those of AVX-512."""
TINY = 1e-300
"""What is added to what may be 0, and is divided by."""
SMALL = 1.0 / 16.0
"""Angle [rad] up to which ``turned`` is right to rounding."""

Roots = dict[str, Expression]
"""What is computed, by the names of ``Rows``."""


class ResponseMatrices(NamedTuple):
    """Columns of the matrices from f at the nodes to x, v and c v + k x there, each in lanes."""

    into_x: Sequence[Expression]
    into_v: Sequence[Expression]
    into_pull: Sequence[Expression]


class Term(NamedTuple):
    """A matrix, column by column in lanes, times values at the nodes, and what it is added to."""

    columns: Sequence[Expression]
    f: Expression
    onto: Expression | None


class SecondOrderEquation(NamedTuple):
    """One equation of second order, or one for each ball, as inputs."""

    name: str
    """Of its inputs, in brackets behind what they are."""
    each: bool
    """Whether it is one for each ball."""
    side: str
    """The same of its left-hand side, which several may have in common."""
    side_each: bool
    """Whether there is a left-hand side for each ball."""
    response: ResponseMatrices

    def __str__(self) -> str:
        return self.name


class Formulas:
    """The formulas for one kind of scene.

    Args:
        model: its equations.
        coordinates: of its deck.
        nodes: how many nodes a step has.
        balls_alike: whether drag slows down all balls alike.
    """

    def __init__(
        self, model: Model, coordinates: Coordinates, nodes: int, balls_alike: bool
    ) -> None:
        self.model, self.coordinates, self.nodes = model, coordinates, nodes
        deck = [f"deck.{q}" for q in range(coordinates.count)]
        alike = coordinates.are_alike
        self.deck = [self._equation(name, False, "deck" if alike else name) for name in deck]
        self.balls = None
        if model.count:
            side = "all balls" if balls_alike else "balls"
            self.balls = self._equation("balls", True, side, not balls_alike)
        self.spindle = self._equation("spindle", False, "spindle") if model.has_motor else None
        self.integral = self._equation("integral", False, "integral")
        """What is only integrated: v is the integral of f."""
        self.own = self._modes()
        self.hangs_freely = not (
            model.has_motor or model.has_energy_balance
        ) and coordinates.only_own_motion(model.effects)
        """Whether c v + k x is all that is to be known of the deck: a motor's spindle is solved for
        together with it, and an energy balance asks for all states."""

    @property
    def equations(self) -> list[SecondOrderEquation]:
        """In the order of their tables; the last one is no equation, but ``integral``."""
        others = [each for each in (self.balls, self.spindle) if each is not None]
        return [*self.deck, *others, self.integral]

    @property
    def integrals(self) -> list[str]:
        """Names of the states that are only integrated, in their order."""
        model = self.model
        names = ["loop"] if model.has_motor else []
        return names + (["work", "dissipated"] if model.has_energy_balance else [])

    def given(self, name: str, of: object = "", level: Level = Level.TIME) -> Expression:
        """An input; with an equation, that of this one."""
        each = isinstance(of, SecondOrderEquation) and of.each
        return self.model.graph.input(f"{name}[{of}]" if of else name, level, each)

    def known(self, name: str, of: SecondOrderEquation) -> Expression:
        """What is known of an equation's left-hand side, as an input."""
        return self.model.graph.input(f"{name}[{of.side}]", Level.TIME, of.side_each)

    def _equation(
        self, name: str, each: bool, side: str, side_each: bool = False
    ) -> SecondOrderEquation:
        def columns(what: str) -> list[Expression]:
            inputs = (f"{what}.{k}[{side}]" for k in range(self.nodes))
            return [self.model.graph.input(one, Level.TIME, side_each) for one in inputs]

        response = ResponseMatrices(columns("into_x"), columns("into_v"), columns("into_pull"))
        return SecondOrderEquation(name, each, side, side_each, response)

    def _modes(self) -> DeckModes | None:
        if not self.coordinates.has_modes:
            return None

        def matrix(name: str) -> list[list[Expression]]:
            make = self.model.graph.input
            return [[make(f"{name}[{r},{q}]", Level.PARAMETER) for q in range(7)] for r in range(7)]

        return DeckModes(matrix("from_modes"), matrix("to_modes"))

    def iterate(self, near: bool) -> Roots:
        """One iteration, from f and what followed from it a moment before.

        Args:
            near: whether angles have changed by less than ``SMALL`` since their cosines and sines
                were computed: these are turned then.
        """
        model, roots = self.model, Roots()
        theta, rate, angles = self._balls_now(near, roots)
        at, axes = self._motion_now(theta, rate)
        c, s = angles
        spindle, _, on, arrow = model.arrow(at, c, s)
        lagged: Number = 0.0
        if self.balls is not None:
            f = self.given("f", self.balls, Level.STATE)
            lagged = path_acceleration(on, f - self.known("damping", self.balls) * rate)
        prescribed = None if model.has_motor else spindle.acceleration
        a = list(self._other_accelerations(arrow, lagged, prescribed))
        changes = self._deck_anew(at, axes, spindle, a, roots)
        spun = self._spindle_anew(a, spindle, roots)
        if self.balls is not None:
            path = self._follow(arrow, a, model.has_motor)
            new = rate_change(on, path) + self.known("damping", self.balls) * rate
            unit = self.known("unit", self.balls)
            f = self.given("f", self.balls, Level.STATE)
            spun.append(total(self._lifted(abs(new - f) * unit)))
            roots[f"f[{self.balls}]"] = self._lifted(new)
        else:
            path = 0.0
        if model.has_energy_balance:
            loss = model.deck.dissipated(model.effects, spindle, at.deck)
            work, lost = powers(
                *(model.effects, model.balls, on, spindle, arrow, Solved(a, path)),
                friction=model.friction(),
                prescribed=not model.has_motor,
                suspension_loss=loss,
            )
            roots["f[work]"], roots["f[dissipated]"] = self._lifted(work), self._lifted(lost)
        self._judged(changes, spun, roots)
        return roots

    def _balls_now(self, near: bool, roots: Roots) -> tuple[Number, Number, tuple[Number, Number]]:
        """Angles, rates, and cosines and sines."""
        if self.balls is None:
            return 0.0, 0.0, (1.0, 0.0)
        f = self.given("f", self.balls, Level.STATE)
        theta, rate = self.moved(self.balls, f)
        if near:
            before = (self.given(name, self.balls, Level.STATE) for name in ("c", "s", "theta"))
            c, s = turned(next(before), next(before), theta - next(before))
        else:
            c, s = cos(theta), sin(theta)
        roots |= {f"{name}[{self.balls}]": x for name, x in (("c", c), ("s", s), ("theta", theta))}
        return theta, rate, (c, s)

    def _motion_now(self, theta: Number, rate: Number) -> tuple[TracedState, Axes]:
        """State at the nodes, the deck's and the spindle's as the last iteration left them."""
        model, driven = self.model, None
        if self.spindle is None:
            axes = self.given("axis_c"), self.given("axis_s")
        else:
            psi = self.given("x", self.spindle, Level.STATE)
            speed = self.given("v", self.spindle, Level.STATE)
            integral = self.given("value", "loop", Level.STATE)
            driven = MotorState(psi, speed, integral, self.given("limit"))
            turned_by = psi - self.given("psi_at_begin")
            axes = cos(turned_by), sin(turned_by)
        if self.hangs_freely:
            deck: Vector = [0.0] * model.states
        else:
            x = [self.given("x", each, Level.STATE) for each in self.deck]
            v = [self.given("v", each, Level.STATE) for each in self.deck]
            deck = self.coordinates.state(self.own, axes, x, v)
        return TracedState(self.given("time"), deck, theta, rate, driven), axes

    def _other_accelerations(self, arrow: Arrow, path: Number, prescribed: Number | None) -> Vector:
        """Accelerations of the deck, and of a motor's spindle, the balls' being given."""
        if len(arrow.force) == 3 and prescribed is not None:
            # A matrix that has nothing but the mass on its diagonal.
            lightness, forces = 1.0 / arrow.block[0][0], []
            for r in range(2):
                force = arrow.force[r] - arrow.block[r][2] * prescribed
                if self.balls is not None:
                    force = force + total(self._lifted(arrow.coupling[r] * path))
                forces.append(force * lightness)
            return [*forces, prescribed]
        return solve_with_balls(arrow, self.model.count, path, prescribed).x

    def _deck_anew(
        self, at: TracedState, axes: Axes, spindle: SpindleMotion, a: list[Number], roots: Roots
    ) -> tuple[Number, Number]:
        """f of the deck's equations, and what its new place changes of the accelerations.

        Returns:
            How far f is from what it was, and of what size it is.
        """
        model, pulls = self.model, []
        change: Number = 0.0
        size: Number = 0.0
        place = DeckPlace(self.own, axes, at.deck)
        accelerations = self.coordinates.accelerations(model.deck, model.effects, spindle, place, a)
        linear = [self.pull(each) for each in self.deck]
        new = [self._lifted(a + b) for a, b in zip(accelerations, linear, strict=True)]
        for each, own, now in zip(self.deck, new, self._pulled(new, roots), strict=True):
            roots[f"f[{each}]"] = own
            f = self.given("f", each, Level.STATE)
            change = change + abs(own - f) * self._unit(each)
            size = size + (abs(own) + abs(now))
            pulls.append(now)
        pulls = [before - now for before, now in zip(linear, pulls, strict=True)]
        for r, more in enumerate(self.coordinates.change(place, pulls)):
            a[r] = a[r] + more
        return change, size

    def _pulled(self, f: Sequence[Expression], roots: Roots) -> list[Number]:
        """c v + k x of the deck's coordinates, from their f."""
        if self.hangs_freely:
            terms = [
                Term(each.response.into_pull, own, self.given("free_pull", each))
                for each, own in zip(self.deck, f, strict=True)
            ]
            return list(self.together(terms))
        found = []
        for each, own in zip(self.deck, f, strict=True):
            x, v = self.moved(each, own)
            roots[f"x[{each}]"], roots[f"v[{each}]"] = x, v
            found.append(self.known("damping", each) * v + self.known("stiffness", each) * x)
        return found

    def pull(self, equation: SecondOrderEquation) -> Number:
        """c v + k x as the last iteration left it; at rest in its middle a deck feels none."""
        if self.hangs_freely:
            return 0.0
        x, v = (self.given(name, equation, Level.STATE) for name in "xv")
        return self.known("damping", equation) * v + self.known("stiffness", equation) * x

    def _spindle_anew(self, a: list[Number], spindle: SpindleMotion, roots: Roots) -> list[Number]:
        """The same of a motor's spindle, and of its loop's integral.

        Returns:
            How far f is from what it was, and of what size it is; nothing without a motor.
        """
        each = self.spindle
        if each is None:
            return []
        damping, f = self.known("damping", each), self.given("f", each, Level.STATE)
        linear = damping * self.given("v", each, Level.STATE)
        new = self._lifted(a[-1] + linear)
        x, v = self.moved(each, new)
        roots |= {f"f[{each}]": new, f"x[{each}]": x, f"v[{each}]": v}
        a[-1] = a[-1] + (linear - damping * v)
        rate = self._lifted(spindle.integral_rate)
        roots["f[loop]"] = rate
        begun = self.given("begin", "loop")
        roots["value[loop]"] = product(self.integral.response.into_v, rate, begun)
        self._spindle_size = abs(new) + abs(linear)
        return [abs(new - f) * self._unit(each)]

    def _unit(self, equation: SecondOrderEquation) -> Number:
        """What f = 1 makes of x at most; 1 without balls, where errors are shares of f."""
        return self.known("unit", equation) if self.balls is not None else 1.0

    def _follow(self, arrow: Arrow, a: Vector, driven: bool) -> Number:
        """Path accelerations of the balls, all others being given."""
        friction, rows, pull = self.model.friction(), list(arrow.coupling), arrow.path_force
        if friction is not None:
            pairs = zip(rows, arrow.normal_coupling, strict=True)
            rows = [reach - friction * press for reach, press in pairs]
            pull = pull - friction * arrow.load
        if not driven:
            # Known before the others.
            pull = pull + rows[-1] * a[-1]
            rows, a = rows[:-1], a[:-1]
        for row, x in zip(rows, a, strict=True):
            pull = pull + row * x
        return self.model.mobility(pull)

    def _judged(self, deck: tuple[Number, Number], others: list[Number], roots: Roots) -> None:
        """How far f is from what it was, in angles, or without balls as a share of its size."""
        changed: Number = 0.0
        for each in others:
            changed = changed + each
        turned_by = across(self._lifted(changed))
        carried = across(self._lifted(deck[0]))
        scales: tuple[Number, Number] = (self.model.graph.input("scale", Level.PARAMETER), 1.0)
        if self.balls is None:
            size = self._spindle_size if self.spindle is not None else 0.0
            scales = (
                1.0 / (across(self._lifted(deck[1])) + TINY),
                1.0 / (across(self._lifted(size)) + TINY),
            )
        found = (carried * scales[0], turned_by * scales[1], *scales)
        roots |= {f"result.{k}": self._lifted(x) for k, x in enumerate(found)}

    def moved(self, equation: SecondOrderEquation, f: Expression) -> tuple[Expression, Expression]:
        """x and v at the nodes."""
        free_x, free_v = (self.given(name, equation) for name in ("free_x", "free_v"))
        response = equation.response
        terms = Term(response.into_x, f, free_x), Term(response.into_v, f, free_v)
        x, v = self.together(terms)
        return x, v

    def together(self, terms: Sequence[Term]) -> list[Expression]:
        """Products at the same time, in as many chains as there are vectors for."""
        count = sum(self.model.count if term.f.each else 1 for term in terms)
        made = count * max(self.nodes // 8, 1)
        return products(terms, max(1, min(CHAINS, ACCUMULATORS // made)))

    def _lifted(self, x: Number) -> Expression:
        return lifted(self.model.graph, x)


def product(
    columns: Sequence[Expression], f: Expression, onto: Expression | None = None
) -> Expression:
    """A matrix, column by column in lanes, times values at the nodes; added to ``onto``."""
    return products([Term(columns, f, onto)], CHAINS)[0]


def products(terms: Sequence[Term], chains: int) -> list[Expression]:
    """Several of these at the same time, column by column of all of them.

    Args:
        terms: the matrices, and what they are multiplied by.
        chains: sums of a product's terms that are made side by side: each term waits for the one
            before.
    """
    sums: list[list[Expression | None]] = [[term.onto] + [None] * (chains - 1) for term in terms]
    for k in range(len(terms[0].columns)):
        for own, (columns, f, _) in zip(sums, terms, strict=True):
            one, before = lane(f, k), own[k % chains]
            own[k % chains] = columns[k] * one if before is None else fma(columns[k], one, before)
    return [_added(own) for own in sums]


def _added(sums: Sequence[Expression | None]) -> Expression:
    left = [each for each in sums if each is not None]
    while len(left) > 1:
        half = (len(left) + 1) // 2
        left = [
            a + left[half + k] if half + k < len(left) else a for k, a in enumerate(left[:half])
        ]
    return left[0]


def turned(c: Number, s: Number, d: Number) -> tuple[Number, Number]:
    """(cos(x + d), sin(x + d)) from those of x, for abs(d) up to ``SMALL``."""
    dd = d * d
    dddd = dd * dd
    a = dd * (dddd * (dd * (1.0 / 40320.0) - 1.0 / 720.0) + (dd * (1.0 / 24.0) - 0.5))
    b = d * (dddd * (dd * (-1.0 / 5040.0) + 1.0 / 120.0) + (dd * (-1.0 / 6.0) + 1.0))
    return c + (c * a - s * b), s + (s * a + c * b)
