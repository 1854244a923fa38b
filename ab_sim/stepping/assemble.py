"""From a system and its machine code to a Run."""

import math

import numpy as np

from ab_sim.dynamics.system import System
from ab_sim.events.event_functions import slots
from ab_sim.events.rows import WIDTH
from ab_sim.events.run import REACH, Balls, Run, Scene, Workspace
from ab_sim.kernels.code import Code

QUATERNION = "quaternion w"
"""Name of the first of a quaternion's states."""


def run_of(
    system: System,
    code: Code,
    step_address: int,
    step: float,
    state: np.ndarray,
    discrete: np.ndarray,
    bounds: np.ndarray,
    memory: tuple[int, int] = (0, 0),
) -> Run:
    """A Run.

    Args:
        system: what moves.
        code: of its kind, for segments of one kind.
        step_address: of the stepper's emitted step.
        step: s.
        state: shape (states,); changes as the run goes on.
        discrete: ``Balls.discrete``; likewise.
        bounds: magnitudes that no sound run reaches, shape (states,).
        memory: shape of what the stepper carries from step to step.
    """
    model = code.model
    events = model.has_events
    scene = Scene(
        prepare=code.address("prepare"),
        evaluate=code.address("evaluate") if events else 0,
        arrow=code.address("arrow") if model.has_contact else 0,
        step=step_address,
        finish=code.address("finish"),
        kick=code.address("kick") if model.has_contact else 0,
        restitution=code.address("restitution") if model.has_contact else 0,
        c=code.constants(system),
    )
    balls = balls_of(system, code, discrete)
    work = workspace(balls, bounds, memory)
    names = type(system.carrier).STATE_NAMES
    return Run(
        scene,
        balls,
        work,
        state,
        step,
        place=code.layout.place,
        ball_column=len(code.emission.roots["sample"]),
        quaternion=names.index(QUATERNION) if QUATERNION in names else -1,
        has_events=events,
    )


def balls_of(system: System, code: Code, discrete: np.ndarray) -> Balls:
    """The balls of a system, with room for what is evaluated of them."""
    model = code.model
    n, states, every = model.count, model.states, model.unknowns
    return Balls(
        number=n,
        constants=np.ascontiguousarray(system.balls),
        contacts=np.ascontiguousarray(system.contacts),
        discrete=discrete,
        branches=aligned((code.branches(),)),
        table=aligned((REACH + 2 * every, n)),
        block=aligned((every, every + 1)),
        x=aligned((every,)),
        motor=aligned((3,)),
        force=aligned((n,)),
        push=aligned((n,)),
        accelerations=every,
        free=every if model.has_motor else every - 1,
        first_angle=states,
        first_rate=states + n,
        spindle=states + 2 * n,
        has_friction=model.has_friction,
        has_contact=model.has_contact,
        has_motor=model.has_motor,
        has_energy_balance=model.has_energy_balance,
    )


def workspace(balls: Balls, bounds: np.ndarray, memory: tuple[int, int] = (0, 0)) -> Workspace:
    """A workspace for balls, states with such bounds, and a stepper with such a memory."""
    states, size = (len(bounds),), (slots(balls.number),)
    return Workspace(
        slope=aligned(states),
        trial=aligned(states),
        slope_ahead=aligned(states),
        memory=aligned(memory),
        smooth=np.full(1, math.nan),
        bounds=np.array(bounds),
        value=aligned(size),
        value_ahead=aligned(size),
        rate=aligned(size),
        rate_ahead=aligned(size),
        rounding=aligned(size),
        rows=aligned((balls.number, WIDTH)),
        near=aligned((2, *states)),
        near_value=aligned((3, *size)),
        force_rate=aligned((2, *size)),
        counts=np.zeros(2, np.int64),
    )


def aligned(shape: tuple[int, ...]) -> np.ndarray:
    """Zeros that begin at a cache line: numpy's own alignment costs 10 % or so, at random."""
    size = 8 * math.prod(shape)
    raw = np.zeros(size + 64, np.uint8)
    first = -raw.ctypes.data % 64
    return raw[first : first + size].view(np.float64).reshape(shape)
