"""Build a Run from a system and its machine code."""

import numpy as np

from ab_sim.engine.compiling.kinds import aligned
from ab_sim.engine.events.run import BallEvents, Run, SceneFunctions, Workspace
from ab_sim.engine.events.run_arrays import balls_of, workspace
from ab_sim.engine.integrate.steppers.generalized_alpha import Alpha
from ab_sim.engine.kernels.code import Code, lanes_for, tangent_address
from ab_sim.engine.stepping.implicit import ImplicitSteps
from ab_sim.model.dynamics.system import System

NOWHERE = 0
"""Address of a function that is not called."""


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
    )


def implicit_steps(run: Run, weights: Alpha, code: Code) -> ImplicitSteps:
    """Return a run with steps of the generalized-alpha method, and the memory that these need."""
    lanes, states = lanes_for(code.model.count), run.state.size
    return ImplicitSteps(
        run,
        code.address("slope"),
        tangent_address(code),
        *weights,
        time=np.zeros(1),
        at=aligned((states,)),
        slope_there=aligned((states,)),
        change=aligned((states,)),
        along=aligned((states + 1, lanes)),
        rates=aligned((states, lanes)),
        jacobian=aligned((states, states)),
        equations=aligned((states, states + 1)),
    )


def flags_of(run: Run) -> dict[str, bool]:
    """Return the run's flags, with which the compiler can leave out parts of the driver.

    Code for events takes long to compile, so a scene without events gets a driver without it.
    """
    return {
        "has_events": run.has_events,
        "has_friction": run.balls.has_friction,
        "has_contact": run.balls.has_contact,
        "has_motor": run.balls.has_motor,
    }
