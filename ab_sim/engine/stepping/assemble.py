"""Build a Run from a system and its machine code."""

import numpy as np

from ab_sim.engine.events.run import BallEvents, ImplicitWork, Run, SceneFunctions, Workspace
from ab_sim.engine.events.run_arrays import balls_of, workspace
from ab_sim.engine.kernels.code import Code
from ab_sim.model.dynamics.system import System

NOWHERE, _NO_NUMBERS, _NO_TABLE = 0, np.zeros(0), np.zeros((0, 0))
NOT_IMPLICIT = ImplicitWork(
    slope=NOWHERE,
    tangent=NOWHERE,
    mass=0.0,
    force=0.0,
    newmark=0.0,
    time=_NO_NUMBERS,
    at=_NO_NUMBERS,
    slope_there=_NO_NUMBERS,
    change=_NO_NUMBERS,
    along=_NO_TABLE,
    rates=_NO_TABLE,
    jacobian=_NO_TABLE,
    equations=_NO_TABLE,
)


def run_of(
    system: System,
    code: Code,
    step_address: int,
    step: float,
    state: np.ndarray,
    discrete: np.ndarray,
    bounds: np.ndarray,
) -> Run:
    """Return a Run with newly allocated work arrays.

    Parameters
    ----------
    system
        System to simulate.
    code
        Machine code of its kind of scene.
    step_address
        Address of the stepper's emitted step.
    step
        Step length [s].
    state
        State, shape (states,); updated by the run.
    discrete
        ``BallEvents.discrete``; updated by the run.
    bounds
        Largest valid magnitudes of the states, shape (states,).
    """
    balls = balls_of(system, discrete)
    work = workspace(balls, bounds)
    return run_with(balls, work, system, code, step_address, step, state)


def run_with(
    balls: BallEvents,
    work: Workspace,
    system: System,
    code: Code,
    step_address: int,
    step: float,
    state: np.ndarray,
) -> Run:
    """Return a Run that uses the given arrays, which other runs may share: see ``run_of``."""
    model, contact = code.model, code.model.has_contact
    scene = SceneFunctions(
        prepare=code.address("prepare"),
        evaluate=code.address("evaluate") if model.has_events else NOWHERE,
        arrow=code.address("arrow") if contact else NOWHERE,
        step=step_address,
        finish=code.address("finish"),
        apply_impulse=code.address("apply_impulse") if contact else NOWHERE,
        restitution=code.address("restitution") if contact else NOWHERE,
        c=code.constants(system),
    )
    return Run(
        scene=scene,
        balls=balls,
        work=work,
        state=state,
        step=step,
        place=code.layout.place,
        ball_column=len(code.emission.roots["sample"]),
        quaternion=type(system.deck_model).UNIT_AT,
        has_events=model.has_events,
        is_implicit=False,
        implicit=NOT_IMPLICIT,
    )


def flags_of(run: Run) -> dict[str, bool]:
    """Return the run's flags, with which the compiler can leave out parts of the driver.

    Code for events takes long to compile, so a scene without events gets a driver without it.
    """
    return {
        "has_events": run.has_events,
        "is_implicit": run.is_implicit,
        "has_friction": run.balls.has_friction,
        "has_contact": run.balls.has_contact,
        "has_motor": run.balls.has_motor,
    }
