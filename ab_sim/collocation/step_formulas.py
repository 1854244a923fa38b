"""Formulas of a collocation step beside its iterations: its start, its error, states in it."""

from itertools import groupby

from ab_sim.collocation.coordinates import DeckPlace
from ab_sim.collocation.formulas import TINY, Formulas, Roots, SecondOrderEquation, Term, product
from ab_sim.equations.sums import Number
from ab_sim.kernels.model import Evaluated, TracedState
from ab_sim.tracing import Expression, Level, cos, sin, total, where
from ab_sim.tracing.expression import lifted
from ab_sim.tracing.functions import across, lane

FALLS = 1e-3
"""How fast coefficients are taken to fall at most, from one pair to the next."""
BACK = 4
"""How many of the last coefficients are looked at."""


class StepFormulas:
    """The formulas for one kind of scene.

    Args:
        formulas: those of its iterations.
    """

    def __init__(self, formulas: Formulas) -> None:
        self.of, self.model = formulas, formulas.model

    def _columns(self, name: str) -> list[Expression]:
        return [self.of.given(f"{name}.{k}") for k in range(self.of.nodes)]

    def start(self) -> Roots:
        """What a step begins with: f carried on from the last one, and all that f changes not."""
        of, model, roots = self.of, self.model, Roots()
        at = model.motion()
        carry = self._columns("carry")
        time = self._time()
        roots["time"] = time
        names: list[object] = [*of.equations[:-1], *of.integrals[: model.has_motor]]
        terms = [Term(carry, of.given("old", each), None) for each in names]
        for each, own in zip(names, of.together(terms), strict=True):
            roots[f"f[{each}]"] = own
        moved, ways = model.graph.input("moved", Level.TIME), [f"f[{each}]" for each in of.deck]
        deck = [roots[name] for name in ways]
        on_next = of.coordinates.on_next_axes(cos(moved), sin(moved), deck)
        roots |= dict(zip(ways, on_next, strict=True))
        for each, begun in self._begun(at):
            for name in ("damping", "stiffness", "unit"):
                roots[f"{name}[{each.side}]"] = of.known(name, each)
            x, v = self._freely(each, *begun)
            if each in of.deck and of.hangs_freely:
                damping, stiffness = (of.known(name, each) for name in ("damping", "stiffness"))
                roots[f"free_pull[{each}]"] = damping * v + stiffness * x
                continue
            roots |= {f"free_x[{each}]": x, f"free_v[{each}]": v}
            if each is not of.balls:
                own, (into_x, into_v, _) = roots[f"f[{each}]"], each.response
                now = of.together([Term(into_x, own, x), Term(into_v, own, v)])
                roots[f"x[{each}]"], roots[f"v[{each}]"] = now
        if at.spindle is None:
            roots["axis_c"], roots["axis_s"] = self._axes(time)
        else:
            roots["psi_at_begin"], roots["begin[loop]"] = at.spindle.psi, at.spindle.integral
            into, rate = of.integral.response.into_v, roots.pop("f[loop]")
            roots["value[loop]"] = product(into, rate, at.spindle.integral)
        return roots

    def _time(self) -> Expression:
        given = self.model.graph.input
        time = given("begin", Level.TIME) + given("length", Level.TIME) * self.of.given("node")
        return lifted(self.model.graph, time)

    def _axes(self, time: Expression) -> tuple[Expression, Expression]:
        """Of a prescribed speed, at the instants of the tables of what is integrated."""
        speed = lifted(self.model.graph, self.model.place.segment.speed(time))
        turned_by = product(self.of.integral.response.into_v, speed)
        return cos(turned_by), sin(turned_by)

    def _begun(
        self, at: TracedState
    ) -> list[tuple[SecondOrderEquation, tuple[Expression, Expression]]]:
        """Of each equation x and v at the step's beginning."""
        of = self.of
        x, v = of.coordinates.of_state(of.own, at.deck)
        found = [(each, (x[q], v[q])) for q, each in enumerate(of.deck)]
        if of.balls is not None:
            found.append((of.balls, (at.theta, at.rate)))
        if of.spindle is not None and at.spindle is not None:
            found.append((of.spindle, (at.spindle.psi, at.spindle.speed)))
        return found

    def _moved(self, at: TracedState) -> tuple[list[Expression], list[Expression]]:
        """x and v of each equation at the instants of the tables; alike ones at the same time."""
        of, x, v = self.of, list[Expression](), list[Expression]()
        for _, group in groupby(self._begun(at), lambda pair: pair[0].side):
            terms = []
            for each, begun in group:
                f = of.given("f", each, Level.STATE)
                for columns, free in zip(each.response, self._freely(each, *begun), strict=False):
                    terms.append(Term(columns, f, free))
            found = of.together(terms)
            x, v = x + found[::2], v + found[1::2]
        return x, v

    def _freely(self, each: SecondOrderEquation, x: Expression, v: Expression) -> list[Expression]:
        """What x and v become without f."""
        of = self.of
        g, r = of.known("impulse", each), of.known("impulse_rate", each)
        if each not in of.deck:
            return [x + g * v, r * v]
        k = of.known("stiffness", each)
        return [x + (g * v - of.known("response_to_one", each) * (k * x)), r * v - g * (k * x)]

    def judge(self) -> Roots:
        """What f leaves out by being a polynomial, as errors of the samples and within the step.

        In angles, and the deck's displacement over the race's radius; without a ball as a share of
        f. The next coefficients are taken to fall as the last two pairs do. What that does is as
        exact as the tables: at the step's end much less than within, unless the drag is stiff, as
        Gauss' nodes are right there for polynomials of twice the degree.
        """
        of, columns = self.of, self._columns("coefficient")
        sums: list[Number] = [0.0, 0.0]
        own = [Term(columns, of.given("f", x, Level.STATE), None) for x in of.equations[:-1]]
        for each, coefficients in zip(of.equations[:-1], of.together(own), strict=True):
            last = abs(coefficients)
            if each is not of.balls:
                last = last * of.given("result.3" if each is of.spindle else "result.2")
            for k, name in enumerate(("beyond_samples", "beyond")):
                error = last * of.known(name, each) if of.balls is not None else last
                sums[k] = sums[k] + (total(error) if each.each else error)
        errors = [_continued(lifted(self.model.graph, each)) for each in sums]
        speed = (
            self.model.place.segment.speed(self._time())
            if of.spindle is None
            else of.given("v", of.spindle, Level.STATE)
        )
        length = self.model.graph.input("length", Level.TIME)
        turned_by = across(lifted(self.model.graph, of.given("share") * speed)) * length
        return {"result.4": errors[0], "result.5": errors[1], "result.6": turned_by}

    def sample(self) -> Roots:
        """States at as many samples as there are nodes, and their times."""
        of, model, roots = self.of, self.model, Roots()
        at = model.motion()
        x, v = self._moved(at)
        into, ways = of.integral.response.into_v, len(of.deck)
        if at.spindle is None:
            axes = self._axes(self._time())
        else:
            turned_by = x[-1] - at.spindle.psi
            axes = cos(turned_by), sin(turned_by)
        deck = of.coordinates.state(of.own, axes, x[:ways], v[:ways])
        roots |= {f"deck[{j}]": lifted(model.graph, each) for j, each in enumerate(deck)}
        if of.balls is not None:
            roots |= {"theta": x[ways], "rate": v[ways]}
        if of.spindle is not None:
            roots |= {"psi": x[-1], "omega": v[-1]}
        for name in of.integrals:
            f = of.given("f", name, Level.STATE)
            known = "integral" if name == "loop" else name
            roots[known] = product(into, f, model.graph.input(known))
        begin = model.graph.input("begin", Level.TIME)
        roots["time"] = lifted(model.graph, begin + of.known("impulse", of.integral))
        inside: Number = 1.0
        for name, one in roots.items():
            if name != "time":
                bound = model.graph.input(f"bound[{name}]", Level.TIME, one.each)
                here = where(abs(one) < bound, 1.0, 0.0)
                inside = inside * (_every(here, model.count) if one.each else here)
        roots["inside"] = lifted(model.graph, inside)
        return roots

    def begin(self, found: Evaluated, slope: list[Expression]) -> Roots:
        """f as it is at one instant, as numbers without lanes.

        Args:
            found: what the equations say there.
            slope: rates of change of all states.
        """
        of, model, roots = self.of, self.model, Roots()
        at = model.motion()
        place = DeckPlace(of.own, (1.0, 0.0), at.deck)
        accelerations = of.coordinates.accelerations(
            model.deck, model.effects, found.spindle, place, found.solved.x
        )
        own = model.states
        changes = [*accelerations]
        changes += [slope[own + 1]] if of.balls is not None else []
        changes += [slope[own + 3]] if of.spindle is not None else []
        for (each, (x, v)), change in zip(self._begun(at), changes, strict=True):
            f = change + of.known("damping", each) * v
            if each in of.deck:
                f = f + of.known("stiffness", each) * x
            if each is of.spindle:
                limited = abs(model.graph.input("limit", Level.TIME)) > 0.5
                f = where(limited, change, f)
            roots[f"f[{each}]"] = lifted(model.graph, f)
        roots["speed"] = lifted(model.graph, found.spindle.speed)
        for name, rate in zip(of.integrals, slope[own + 2 + 2 * model.has_motor :], strict=True):
            roots[f"f[{name}]"] = rate
        return roots


def _every(each: Expression, balls: int) -> Expression:
    """1 where all balls have 1, else 0."""
    return where(total(each) > balls - 0.5, 1.0, 0.0)


def _continued(sums: Expression) -> Expression:
    """What comes after the last two pairs of coefficients, if it falls as they do."""
    last, before = lane(sums, 0) + lane(sums, 1), lane(sums, 2) + lane(sums, 3)
    falls = last / (before + TINY)
    falls = where(falls < FALLS, FALLS, where(falls < 1.0, falls, 1.0))
    found: Expression = last * falls
    return found
