"""Symbolic equations of scenes with the same structure; all compiled functions follow from them."""

import functools
from collections.abc import Sequence
from typing import Any, NamedTuple

from ab_sim.engine.kernels.constants import PLACE_FIELDS, traced_balls, traced_bodies
from ab_sim.model.dynamics.system import (
    System,
    has_contact,
    has_friction,
    has_motor,
    has_spindle_angle,
)
from ab_sim.model.equations.arrowhead import Arrow, Solved, powers, solve
from ab_sim.model.equations.motion import (
    ActiveSegment,
    MotorState,
    OnRace,
    SpindleMotion,
    Torques,
    friction_coefficient,
    motor_driven,
    on_race,
    path_length,
    prescribed,
    rate_change,
)
from ab_sim.model.equations.sums import Number, over_effects
from ab_sim.tracing import Expression, Graph, Level, cos, sin
from ab_sim.tracing.expression import rows

OF_EACH_BALL = ("theta", "rate")
"""Names of the states per ball."""


class TracedState(NamedTuple):
    """State at a time, as expressions."""

    time: Number
    """Time since the beginning of the segment of the schedule [s]."""
    deck: Sequence[Number]
    """States of the deck."""
    theta: Number
    """Angle of each ball [rad]."""
    rate: Number
    """Rate of each ball's angle [rad/s]."""
    spindle: MotorState | None
    """State of the spindle in a scene with a motor, else None."""


class Evaluated(NamedTuple):
    """Equations of motion at a state, with their solution, as expressions."""

    spindle: SpindleMotion
    torques: Torques | None
    """Torques of the motor in a scene with one, else None."""
    on: OnRace
    """Positions of the balls on the race."""
    arrow: Arrow
    """Equations of motion."""
    solved: Solved
    """Accelerations that satisfy the equations of motion."""


class Model:
    """Equations of a kind of scene as expressions, with the scene's numbers as inputs.

    A kind has one deck model, the same effects, one number of balls, and one class of segments.

    Parameters
    ----------
    system
        Any system of this kind.
    segment
        Class of the segments.
    """

    def __init__(self, system: System, segment: type[Any]) -> None:
        self.graph = Graph()
        self.count = len(system.balls)
        self.deck, self.effects = traced_bodies(system, self._parameter)
        self.balls = traced_balls(self.count, lambda name: self._parameter(name, per_ball=True))
        fields = [self._parameter(f"segment.{name}") for name in segment._fields]
        self.place = ActiveSegment(segment(*fields), *map(self._parameter, PLACE_FIELDS))
        self.states = type(system.deck_model).STATES
        self.unknowns: int = type(system.deck_model).UNKNOWNS + 1
        self.has_motor = has_motor(self.effects)
        self.has_friction = has_friction(self.effects)
        self.has_contact = has_contact(self.effects)
        self.has_events = self.has_motor or self.has_friction or self.has_contact
        self.has_energy_balance = bool(system.energy_balance)
        self.angle_needed = has_spindle_angle(system)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the inputs that are states, in order; ``OF_EACH_BALL`` stand for all balls."""
        return (
            *(f"deck[{j}]" for j in range(self.states)),
            *OF_EACH_BALL,
            *(("psi", "omega", "integral") if self.has_motor else ()),
            *(("work", "dissipated") if self.has_energy_balance else ()),
        )

    def state_inputs(self) -> list[Expression]:
        """Return the inputs of all states in the state's order; one input stands for all balls."""
        return [self.graph.input(name, per_ball=name in OF_EACH_BALL) for name in self.state_names]

    def _parameter(self, name: str, per_ball: bool = False) -> Expression:
        return self.graph.input(name, Level.PARAMETER, per_ball)

    def motion(self) -> TracedState:
        """Return the state in memory, as inputs, at the input ``time``."""
        input_ = self.graph.input
        spindle = None
        if self.has_motor:
            # The motor's branch changes at events only, so it is not a state.
            limit = input_("limit", Level.TIME)
            spindle = MotorState(input_("psi"), input_("omega"), input_("integral"), limit)
        return TracedState(
            input_("time", Level.TIME),
            [input_(f"deck[{j}]") for j in range(self.states)],
            input_("theta", per_ball=True),
            input_("rate", per_ball=True),
            spindle,
        )

    def friction(self) -> Number | None:
        """Return each ball's signed coefficient of sliding friction, or None without friction.

        The sign is that of the branches, not of the rate: it stays the same through all stages of a
        step, so that the equations are smooth within it.
        """
        if not self.has_friction:
            return None
        sign = self.graph.input("sign", Level.TIME, per_ball=True)
        return sign * friction_coefficient(self.effects, self.balls)

    def mobility(self, force: Number, ahead: Number | None = None) -> Number:
        """Return the balls' accelerations under a force (``equations.arrowhead.Mobility``).

        Parameters
        ----------
        force
            Force along the race on each ball.
        ahead
            Time [s] after which the drag is evaluated, at the speed reached then; None evaluates it
            at the speed of the state.
        """
        if ahead is not None:
            drag = over_effects(self.effects, "ball_drag", 0.0, self.balls.each)
            force = force / (1.0 + ahead * (drag * self.balls.mobility))
        if self.has_contact:
            return rows(self.lifted(force))
        if self.has_friction:
            return force * self.graph.input("mobility_now", Level.TIME, per_ball=True)
        return force * self.balls.mobility

    def spindle(self, at: TracedState) -> tuple[SpindleMotion, Torques | None]:
        """Return the spindle's motion and, with a motor, its torques."""
        if at.spindle is None:
            return prescribed(self.effects, self.place, at.time, self.angle_needed), None
        return motor_driven(self.effects, self.place, at.time, at.spindle, self.angle_needed)

    def arrow(
        self, at: TracedState, c: Number | None = None, s: Number | None = None
    ) -> tuple[SpindleMotion, Torques | None, OnRace, Arrow]:
        """Return the spindle's motion and torques, the balls' positions, and the equations.

        Parameters
        ----------
        at
            State at which the equations are evaluated.
        c, s
            Cosine and sine of the balls' angles; None to compute them.
        """
        spindle, torques = self.spindle(at)
        c = cos(at.theta) if c is None else c
        s = sin(at.theta) if s is None else s
        on = on_race(self.effects, self.balls, c, s, at.rate)
        arrow = self.deck.arrow(self.effects, self.balls, on, spindle, at.deck)
        return spindle, torques, on, arrow

    def evaluated(self, at: TracedState, ahead: Number | None = None) -> Evaluated:
        """Return the equations of motion and their solution; ``ahead``: see ``mobility``."""
        spindle, torques, on, arrow = self.arrow(at)
        prescribed_one = None if self.has_motor else spindle.acceleration
        mobility = functools.partial(self.mobility, ahead=ahead)
        solved = solve(arrow, self.count, mobility, self.friction(), prescribed_one)
        return Evaluated(spindle, torques, on, arrow, solved)

    def slope(self, at: TracedState, forces: Evaluated) -> list[Expression]:
        """Return the rates of change of all states, in order; one expression for all balls."""
        spindle, torques, on, arrow, solved = forces
        deck = self.deck.rates(self.effects, spindle, at.deck, solved.x)
        rates = [*deck, at.rate, rate_change(on, solved.path)]
        if at.spindle is not None:
            rates += [spindle.speed, solved.x[-1], spindle.integral_rate]
        if self.has_energy_balance:
            loss = self.deck.dissipated(self.effects, spindle, at.deck)
            rates += powers(
                self.effects,
                self.balls,
                on,
                spindle,
                arrow,
                solved,
                friction=self.friction(),
                prescribed=not self.has_motor,
                suspension_loss=loss,
            )
        return [self.lifted(rate) for rate in rates]

    def sample(self, at: TracedState, forces: Evaluated) -> list[Expression]:
        """Return a sample's row without the balls and the torque, at the input ``profile_time``.

        Whole turns of a motor's spindle are left out.
        """
        when = self.graph.input("profile_time", Level.TIME)
        law, turned = self.place.law, self.place.law.angle(when)
        requested, spindle = law.speed(when), forces.spindle
        if at.spindle is None:
            angle, speed, psi = self.place.angle + turned, requested, self.place.phase + turned
        else:
            angle, speed, psi = at.spindle.psi, at.spindle.speed, at.spindle.psi
        spindle_here = spindle._replace(cos=cos(psi), sin=sin(psi))
        deck_channels = self.deck.channels(self.effects, spindle_here, at.deck, forces.solved.x)
        row = [angle, speed, requested, *deck_channels]
        return [self.lifted(x) for x in row]

    def table(self, at: TracedState, forces: Evaluated) -> list[Expression]:
        """Return columns of the balls' table for events, see ``ab_sim.engine.events``."""
        _, _, on, arrow, solved = forces
        friction = self.friction()
        along = 0.0
        if self.has_contact:
            along = path_length(self.effects, self.balls, at.theta)
        columns = [
            arrow.load,
            self.balls.rolling_mass,
            arrow.path_force,
            0.0 if friction is None else friction,
            friction_coefficient(self.effects, self.balls),
            on.path,
            on.curve,
            along,
            solved.path,
            *arrow.coupling,
            *arrow.normal_coupling,
        ]
        return [self.lifted(x) for x in columns]

    def with_forces(
        self, columns: Sequence[Expression], x: Sequence[Expression]
    ) -> list[Expression]:
        """Return the columns of ``table`` with three more that depend on the accelerations.

        These are NORMAL, PULL and SIZE of ``events.run``: the normal force, the force along the
        race minus sliding friction, and the magnitude of their terms, which bounds their rounding
        errors (``events.balls.force_rounding``).
        """
        load, _, pull, friction, *others = columns
        coupling, press = others[5 : 5 + len(x)], others[5 + len(x) :]
        normal = load if self.has_friction else self.lifted(0.0)
        for r, acceleration in enumerate(x):
            pull = pull + coupling[r] * acceleration
            normal = normal + press[r] * acceleration if self.has_friction else normal
        pull = pull - friction * normal
        size = abs(pull) + self.balls.mass * (abs(x[0]) + abs(x[1])) + abs(normal)
        return [*columns[:9], normal, pull, size, *columns[9:]]

    def block(self, arrow: Arrow) -> list[Expression]:
        """Return the equations' block row by row, with the forces in its last column."""
        lines = [[*line, f] for line, f in zip(arrow.block, arrow.force, strict=True)]
        return [self.lifted(x) for line in lines for x in line]

    def restitution(self) -> Expression:
        """Return the coefficient of restitution for the input ``approach`` [m/s]."""
        approach = self.graph.input("approach")
        return self.lifted(over_effects(self.effects, "restitution", 0.0, approach))

    def jump(self, at: TracedState) -> list[Expression]:
        """Return the changes of the deck's states by jumps of velocity, the inputs ``jump[r]``."""
        jumps = [self.graph.input(f"jump[{r}]") for r in range(self.unknowns)]
        return [self.lifted(x) for x in self.deck.jump(at.deck, jumps)]

    def lifted(self, x: Number) -> Expression:
        """Return an expression unchanged, and a number as a constant."""
        return x if isinstance(x, Expression) else self.graph.constant(x)
