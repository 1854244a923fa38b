"""Runs of the reference: one solve_ivp for every mode, with events located by scipy."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from . import friction, motor
from .contact import chain_of, impact
from .dynamics import STUCK, Forces, Mode, solve
from .friction import Guard
from .model import Model
from .params import Params
from .plant import Array, Plant


class Event(NamedTuple):
    """Event at ``time`` [s].

    Kinds of a ball: stick, reverse, release, load, unload; of a contact: impact, part; motor: a
    change of its regime. For contacts, ``ball`` is the rear one; ``loss`` is the energy [J] that an
    impact dissipates.
    """

    time: float
    kind: str
    ball: int
    loss: float = 0.0


@dataclass(frozen=True)
class Start:
    """State at t = 0, deck relative to its static equilibrium, balls relative to the race."""

    x: float = 0.0
    y: float = 0.0
    vx: float = 0.0
    vy: float = 0.0
    rates: tuple[float, ...] = ()
    """Ball rates theta_i' [rad/s]; default: 0."""
    speed: float | None = None
    """Speed w with a motor [rad/s]; default: that of the command."""
    z: float = 0.0


@dataclass(frozen=True)
class Result:
    """Motion at ``times``; arrays have one row per time. Energies are integrals from t = 0."""

    plant: Plant
    times: Array
    q: Array
    """x, y, psi, psi_1, ..., or with the deck's other four coordinates after y."""
    rates: Array
    """Rates q'."""
    z: Array
    work: Array
    """Work of the external torque on the rotor [J]."""
    losses: Array
    """Losses of suspension, drag, friction and impacts [J], four columns."""
    events: tuple[Event, ...]

    @property
    def x(self) -> Array:
        """Return the deck's inertial x [m], from its equilibrium; in space from relaxed springs."""
        return self.q[:, 0]

    @property
    def y(self) -> Array:
        """Return y of the deck [m], counted like ``x``."""
        return self.q[:, 1]

    @property
    def vx(self) -> Array:
        """Return the deck's velocity along x [m/s], inertial."""
        return self.rates[:, 0]

    @property
    def vy(self) -> Array:
        """Return the deck's velocity along y [m/s], inertial."""
        return self.rates[:, 1]

    @property
    def deck(self) -> Array:
        """Return the deck's coordinates, a column for each."""
        return self.q[:, : self.plant.psi]

    @property
    def deck_rates(self) -> Array:
        """Return the rates of the deck's coordinates, a column for each."""
        return self.rates[:, : self.plant.psi]

    @property
    def psi(self) -> Array:
        """Return the spindle angle [rad]."""
        return self.q[:, self.plant.psi]

    @property
    def w(self) -> Array:
        """Return the spindle speed [rad/s]."""
        return self.rates[:, self.plant.psi]

    @property
    def theta(self) -> Array:
        """Return the ball angles from the unbalance [rad], unwrapped, a column for each ball."""
        return self.plant.theta(self.q)

    @property
    def theta_rate(self) -> Array:
        """Return the ball rates theta_i' [rad/s], a column for each ball."""
        return self.plant.theta(self.rates)

    def energy(self) -> Array:
        """Return the energy of motion, springs and gravity [J]."""
        pairs = zip(self.q, self.rates, strict=True)
        return np.array([self.plant.energy(q, v) for q, v in pairs])

    def imbalance(self) -> Array:
        """Return the change of E - work + losses since the first time [J], which must be 0."""
        kept = self.energy() - self.work + self.losses.sum(axis=1)
        return kept - kept[0]


class Problem:
    """State vector (q, q', z, work, three losses) and its derivative in a mode.

    Scipy evaluates several events at one state, so the last forces are cached.
    """

    def __init__(self, plant: Plant, angles: Array) -> None:
        self.p, self.plant, self.size = plant.p, plant, plant.size
        self.chain = chain_of(plant, angles)
        self._key: tuple[float, bytes] | None = None
        self._guards: list[Guard] = []

    def split(self, y: Array) -> tuple[Array, Array, float]:
        """Return q, q' and z."""
        return y[: self.size], y[self.size : 2 * self.size], float(y[2 * self.size])

    def forces(self, start: float, t: float, y: Array, mode: Mode) -> Forces:
        """Return the forces in a mode, on the command's segment in force after ``start``."""
        asked = motor.command(self.p, start, t)
        return solve(self.plant, self.chain, mode, asked, *self.split(y))

    def derivative(self, start: float, mode: Mode, t: float, y: Array) -> Array:
        """Return the derivative of the state vector."""
        forces = self.forces(start, t, y, mode)
        _, rates, _ = self.split(y)
        driven = [forces.integrator, forces.torque * rates[self.plant.psi]]
        return np.concatenate([rates, forces.accelerations, driven, forces.losses])

    def guards(self, start: float, t: float, y: Array, mode: Mode) -> list[Guard]:
        """Return the guards of all events that can end the mode."""
        key = (t, y.tobytes())
        if key != self._key:
            asked = motor.command(self.p, start, t)
            forces = self.forces(start, t, y, mode)
            state = self.split(y)
            self._guards = friction.guards(self.plant, self.chain, mode, asked, forces, *state)
            self._key = key
        return self._guards

    def events(self, start: float, y: Array, mode: Mode) -> list[Callable[[float, Array], float]]:
        """Return one event function for each guard, as scipy needs them."""
        self._key = None

        def event(index: int) -> Callable[[float, Array], float]:
            def value(t: float, y: Array) -> float:
                return self.guards(start, t, y, mode)[index].value

            value.terminal, value.direction = True, -1  # type: ignore[attr-defined]
            return value

        return [event(i) for i in range(len(self.guards(start, start, y, mode)))]


def tolerances(plant: Plant, rtol: float, implicit: bool) -> tuple[Array | float, Array]:
    """Return rtol and atol of the state vector; angles and speeds grow, so theirs are absolute.

    Scipy's implicit methods take no rtol by component, so there all tolerances are absolute.
    """
    turning, floor = 1 + plant.count, 2.3e-14
    places, rates = (3.0 * np.array(s) if implicit else np.array(s) for s in plant.scales)
    turns, gains = np.full(turning, 1.0), np.full(turning, 10.0)
    scales = np.concatenate([places, turns, rates, gains, [1.0], [1e-3] * 4])
    if implicit:
        return max(rtol * 1e-4, 1e-13), rtol * scales
    half = [rtol] * plant.psi + [floor] * turning
    return np.array([*half, *half, *[rtol] * 5]), rtol * scales


def simulate(
    params: Params,
    theta0: Sequence[float],
    times: Sequence[float] | Array,
    *,
    start: Start | None = None,
    method: str = "DOP853",
    rtol: float = 1e-12,
    max_step: float = np.inf,
    max_events: int = 100_000,
) -> Result:
    """Return the planar rotor's motion from rest at the static equilibrium.

    Parameters
    ----------
    params
        Parameters of the rotor.
    theta0
        Ball angles from the unbalance [rad].
    times
        Increasing times from 0 or later [s].
    start
        Another start than rest.
    method
        See ``follow``.
    rtol
        See ``follow``.
    max_step
        See ``follow``.
    max_events
        See ``follow``.
    """
    p, s = params, start or Start()
    theta = np.array(theta0, float)
    if theta.shape != (p.count,):
        raise ValueError(f"{p.count} ball angles, please")
    slide = np.array(s.rates or np.zeros(p.count), float)
    return follow(
        Model(p), [s.x, s.y], theta, [s.vx, s.vy], slide, times, speed=s.speed, z=s.z,
        method=method, rtol=rtol, max_step=max_step, max_events=max_events,
    )  # fmt: skip


def follow(
    plant: Plant,
    deck: Sequence[float] | Array,
    theta: Array,
    deck_rates: Sequence[float] | Array,
    theta_rates: Array,
    times: Sequence[float] | Array,
    *,
    speed: float | None = None,
    z: float = 0.0,
    method: str = "DOP853",
    rtol: float = 1e-12,
    max_step: float = np.inf,
    max_events: int = 100_000,
) -> Result:
    """Return the motion from a state at t = 0.

    Parameters
    ----------
    plant
        Rotor or deck to simulate.
    deck
        Coordinates of the deck.
    theta
        Ball angles from the unbalance [rad].
    deck_rates
        Rates of the deck's coordinates.
    theta_rates
        Ball rates theta_i' [rad/s].
    times
        Increasing times from 0 or later [s].
    speed
        Speed w with a motor [rad/s]; default: that of the command.
    z
        Integral of the motor's controller.
    method
        Method of solve_ivp; "Radau" for a stiff race.
    rtol
        Relative tolerance; the absolute ones follow from it.
    max_step
        Longest step [s], if an event could hide within a step.
    max_events
        Number of events after which the simulation fails.
    """
    p = plant.p
    problem = Problem(plant, theta)
    asked = motor.command(p, 0.0, 0.0)
    w = asked.speed if speed is None or p.motor is None else speed
    places: Array = np.concatenate([deck, [asked.angle], asked.angle + theta])
    y: Array = np.concatenate([places, deck_rates, [w], w + theta_rates, [z], np.zeros(4)])
    out = np.asarray(times, float)
    stops = [b for b in motor.breakpoints(p) if 0.0 < b < out[-1]] + [float(out[-1])]
    relative, absolute = tolerances(plant, rtol, method in ("Radau", "BDF", "LSODA"))
    states = [np.append(y, 0.0)] * int(out[0] <= 0.0)
    events: list[Event] = []
    now, knocked = 0.0, 0.0
    y, mode = fresh(problem, now, y)
    while now < out[-1]:
        stop = next(b for b in stops if b > now)
        within = set(out[(out > now) & (out <= stop)])
        solution = solve_ivp(
            partial(problem.derivative, now, mode), (now, stop), y, method=method,
            t_eval=sorted(within | {stop}), rtol=relative, atol=absolute, max_step=max_step,
            events=problem.events(now, y, mode),
        )  # fmt: skip
        if solution.status < 0:
            raise RuntimeError(solution.message)
        for t, state in zip(solution.t, np.transpose(solution.y), strict=True):
            if t in within:
                states.append(np.append(state, knocked))
        if solution.status == 0:
            now, y = stop, solution.y[:, -1]
            y, mode = fresh(problem, now, y)
            continue
        which = next(i for i, hits in enumerate(solution.t_events) if hits.size)
        begin, now, y = now, float(solution.t_events[which][0]), solution.y_events[which][0]
        guard = problem.guards(begin, now, y, mode)[which]
        event, y = happen(problem, guard, now, y)
        knocked += event.loss
        y, mode = fresh(problem, now, y)
        if event.kind == "stop":
            stuck = mode.balls[event.ball] == STUCK
            event = event._replace(kind="stick" if stuck else "reverse")
        events.append(event)
        if len(events) > max_events:
            raise RuntimeError(f"more than {max_events} events by t = {now}")
    table, size = np.array(states), problem.size
    tail = table[:, 2 * size :]
    return Result(
        plant, out, table[:, :size], table[:, size : 2 * size], tail[:, 0], tail[:, 1], tail[:, 2:],
        tuple(events),
    )  # fmt: skip


def fresh(problem: Problem, now: float, y: Array) -> tuple[Array, Mode]:
    """Return the state with the constraints of the mode just after ``now`` met, and the mode."""
    asked = motor.command(problem.p, now, now)
    q, rates, z = problem.split(y)
    mode = friction.choose_mode(problem.plant, problem.chain, asked, q, rates, z)
    q, rates = friction.settled(problem.plant, problem.chain, mode, q, rates)
    rest = y[2 * problem.size :].copy()
    return np.concatenate([q, rates, rest]), mode


def happen(problem: Problem, guard: Guard, now: float, y: Array) -> tuple[Event, Array]:
    """Return the event of a guard, and the state after it; only an impact changes the state."""
    chain, size = problem.chain, problem.size
    ball = int(chain.behind[guard.which]) if guard.kind in ("impact", "part") else guard.which
    if guard.kind != "impact":
        return Event(now, guard.kind, ball), y
    q, rates, _ = problem.split(y)
    plant, psi = problem.plant, problem.plant.psi
    after = impact(plant, chain, guard.which, q, rates)
    gained = plant.energy(q, after) - plant.energy(q, rates)
    after_y = np.concatenate([q, after, y[2 * size :]])
    if problem.p.motor is None:
        # What holds the spindle's speed gives an impulse, too. It turns the spindle and all balls:
        # so their equations' sum tells it, in which what acts between them cancels out.
        kick = plant.system(q, rates).mass[psi:].sum(axis=0) @ (after - rates) * rates[psi]
        after_y[2 * size + 1] += kick
        gained -= kick
    return Event(now, "impact", ball, -gained), after_y
