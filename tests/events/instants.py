"""Random instants of a planar drive with four balls, for the package and for the reference."""

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq

from ab_sim.engine.compiling.kinds import call
from ab_sim.engine.events.balls import put_branches
from ab_sim.engine.events.run import Run, evaluate
from ab_sim.engine.kernels.code import code_of
from ab_sim.engine.stepping.assemble import run_of
from ab_sim.model.dynamics.assemble import start_discrete_state, system_of
from ab_sim.model.dynamics.system import (
    DIRECTION,
    JOINED,
    ORDER,
    TURNS,
    StateLayout,
    System,
    layout_of,
)
from ab_sim.model.equations.neighbours import reduced
from ab_sim.model.spindle import Ramp
from ab_sim.scene import Scene, check_scene
from tests.conftest import MOTOR, THESIS, merge
from tests.reference.contact import Chain, chain_of
from tests.reference.model import Model
from tests.reference.motor import Command
from tests.reference.of_scene import params_of

N = 4
PHASE, ASKED, SLOPE = 0.7, 90.0, 30.0
"""Spindle angle [rad], commanded speed [rad/s] and acceleration [rad/s^2]."""
OVAL: dict[str, Any] = {
    "gravity": {"tilt": 1.2, "direction": 0.7},
    "hardening_suspension": {"cubic_stiffness": 1e8},
    "race_runout": {"offset_1": 3e-4, "offset_2": -2e-4, "lobe": 1e-3, "lobe_angle": 0.3},
}
UNEQUAL: dict[str, Any] = {
    "suspension": None,
    "unequal_suspension": {
        "stiffness_1": 1000.0,
        "stiffness_2": 1400.0,
        "damping_1": 0.1,
        "damping_2": 0.3,
        "axis_angle": 0.4,
    },
}
RUBBING: dict[str, Any] = {
    "rolling_friction": {"arm": 2e-4},
    "race_friction": {"coefficient": 0.4},
}
TOUCHING: dict[str, Any] = {"ball_contact": {"restitution_coefficient": 0.6}}
COMPANIES: dict[str, dict[str, Any]] = {
    "all": {**OVAL, **UNEQUAL, **RUBBING, **TOUCHING, "motor": MOTOR},
    "thesis": {},
    "oval": OVAL,
    "oval, friction": {**OVAL, **RUBBING},
    "round, friction, contact": {**RUBBING, **TOUCHING, "viscous_drag": None},
    "oval, contact, motor": {**OVAL, **TOUCHING, "motor": MOTOR},
}
"""Sets of effects in addition to those of the thesis."""


def scene_with(effects: dict[str, Any], angles: list[float] | None = None) -> Scene:
    """Return the thesis' drive with four unequal balls."""
    balls = {"count": N, "mass": [1e-3, 6e-4, 1.4e-3, 8e-4], "radius": [1e-3, 8e-4, 1.2e-3, 9e-4]}
    changes = {"balls": balls, "effects": effects, "start": {"ball_angles": angles}}
    return check_scene(merge(THESIS, changes), "test")


class Instant(NamedTuple):
    """State with its mode and workspace, and with the reference's model."""

    run: Run
    system: System
    layout: StateLayout
    model: Model
    chain: Chain
    z: float
    """Integral of the speed loop."""

    @property
    def state(self) -> np.ndarray:
        return self.run.state

    @property
    def discrete(self) -> np.ndarray:
        return self.run.balls.discrete

    @property
    def order(self) -> np.ndarray:
        """Return the number of the ball at each place in the row."""
        return self.system.contacts[:, ORDER].astype(int)

    @property
    def asked(self) -> Command:
        """Return the command of the spindle for the reference."""
        return Command(PHASE, ASKED, SLOPE)

    def evaluate(self) -> np.ndarray:
        """Compute the slope of the state and the table that goes with it; return the slope."""
        put_branches(self.run.balls)
        evaluate(self.run, 0.0, self.state, self.run.work.slope)
        return self.run.work.slope

    def coordinates(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the reference's coordinates q and rates q' of the present state."""
        state, layout, turn = self.state, self.layout, turn_by(PHASE)
        w = state[layout.spindle][1] if layout.spindle.stop > layout.spindle.start else ASKED
        x, v = turn @ state[:2], turn @ state[2:4]
        turns = self.discrete[:N, TURNS]
        return (
            np.array([*x, PHASE, *(PHASE + state[layout.angles] + 2 * np.pi * turns)]),
            np.array([*v, w, *(w + state[layout.rates])]),
        )

    def accelerations(self) -> np.ndarray:
        """Return the reference's accelerations q'' from the present slope."""
        slope, state, layout = self.run.work.slope, self.state, self.layout
        w = self.coordinates()[1][2]
        al = slope[layout.spindle][1] if layout.spindle.stop > layout.spindle.start else SLOPE
        v1, v2 = state[2:4]
        deck = turn_by(PHASE) @ (slope[2:4] + w * np.array([-v2, v1]))
        return np.array([*deck, al, *(al + slope[layout.rates])])


def turn_by(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def instant(random: np.random.Generator, effects: dict[str, Any], together: float = 0.6) -> Instant:
    """Return a random instant.

    Parameters
    ----------
    random
        Random generator.
    effects
        Effects of the scene.
    together
        Probability that neighbours touch at equal speeds; half of it is the probability that a ball
        is at rest on the race, with those that touch it.
    """
    begin = random.uniform(-9.0, 9.0) + np.arange(N) * 2 * np.pi / N
    scene = scene_with(effects, begin.tolist())
    model = Model(params_of(scene))
    chain = chain_of(model, begin)
    # Since the start they have gone along, some more than once around.
    apart = random.uniform(0.6, 1.6, N)
    angles = random.uniform(-9.0, 9.0) + np.cumsum(apart * 2 * np.pi / apart.sum())
    touch = (random.random(N - 1) < together) & ("ball_contact" in effects)
    for k in np.flatnonzero(touch):
        angles[k + 1] = _next_to(chain, angles, k)
    speeds = random.normal(0.0, 0.3, N) * (random.random(N) > 0.5 * together)
    for k in np.flatnonzero(touch):
        speeds[k + 1] = speeds[k]
    system = system_of(scene, energy_balance=True)
    layout = layout_of(system)
    state, z = np.zeros(layout.size), 0.0
    state[:4] = random.normal(0.0, [4e-3, 4e-3, 0.2, 0.2])
    state[layout.rates] = speeds / model.curve.at(angles)[2]
    if "motor" in effects:
        z = float(random.uniform(-1.5, 1.5))
        state[layout.spindle] = PHASE, random.uniform(70.0, 110.0), z
    discrete_state = start_discrete_state(scene, system)
    state[layout.angles], discrete_state[:N, TURNS] = zip(*map(reduced, angles), strict=True)
    discrete_state[:N, DIRECTION] = np.sign(speeds)
    order = system.contacts[:, ORDER].astype(int)
    discrete_state[: len(order), JOINED] = np.append(touch, False)[order]
    run = run_at_once(system, state, discrete_state)
    return Instant(run, system, layout, model, chain, z)


def run_at_once(system: System, state: np.ndarray, discrete: np.ndarray) -> Run:
    """Return a Run for evaluations only, on a ramp from ``ASKED``."""
    code = code_of(system, Ramp)
    run = run_of(system, code, 0, 1e-3, state, discrete, np.full(len(state), np.inf))
    run.scene.c[run.place : run.place + 5] = ASKED, SLOPE, PHASE, math.inf, PHASE
    call(run.scene.prepare, run.scene.c)
    return run


def _next_to(chain: Chain, angles: np.ndarray, k: int) -> float:
    """Return the angle at which ball k + 1 touches ball k."""
    contact = int(np.flatnonzero((chain.behind == k) & (chain.ahead == k + 1))[0])

    def gap(angle: float) -> float:
        return float(chain.gaps(np.array([*angles[: k + 1], angle, *angles[k + 2 :]]))[contact])

    return float(brentq(gap, angles[k] + 0.01, angles[k + 1], xtol=1e-15, rtol=1e-15))
