"""Build the runs of Taylor's method from a system and its machine code."""

import math

from ab_sim.base.errors import SceneError
from ab_sim.engine.compiling.kinds import aligned
from ab_sim.engine.events.run import Run
from ab_sim.engine.integrate.steppers.taylor import PARTS, TaylorParameters
from ab_sim.engine.kernels.code import Code
from ab_sim.engine.taylor.clock import (
    CLOCK,
    ENDS_STEPS,
    EVERY,
    LOG_TOLERANCE,
    LONGEST,
    SHORTEST,
    SOUND,
    SOUND_STEPS,
    STATUS_LINES,
    STEP,
)
from ab_sim.engine.taylor.driver import STATE, TaylorRun, TaylorRuns
from ab_sim.engine.taylor.emission import TaylorEmission
from ab_sim.model.dynamics.system import System, layout_of
from ab_sim.tracing.derivatives import NotAnalyticError
from ab_sim.tracing.llvm_text import module_text
from ab_sim.tracing.machine_code import AS_WRITTEN, MachineCode


class TaylorCode:
    """Machine code of Taylor steps for a kind of scene.

    Parameters
    ----------
    code
        Machine code of the scene's equations.
    order
        Order of the series.
    lanes
        Number of runs side by side.

    Raises
    ------
    SceneError
        A formula has no Taylor series.
    """

    def __init__(self, code: Code, order: int, lanes: int) -> None:
        emission = TaylorEmission(code.emission, order)
        self.size = emission.size
        try:
            functions = emission.functions(lanes)
        except NotAnalyticError as error:
            raise SceneError(f"solver.stepper = 'taylor': {error}; use rk8") from error
        self._code = MachineCode(module_text(functions), optimization=AS_WRITTEN)
        self.addresses = {
            function.name: self._code.address(function.name) for function in functions
        }


def taylor_code(code: Code, order: int, lanes: int) -> TaylorCode:
    """Return the code for a kind of scene, which ``code`` caches."""
    return code.other((TaylorCode, order, lanes), lambda: TaylorCode(code, order, lanes))


def memory_size(system: System) -> int:
    """Return the count of numbers in the memory that Taylor's method keeps for a run."""
    return STATE + layout_of(system).size + len(system.balls)


def lanes_of(
    system: System, code: Code, parameters: TaylorParameters, step: float, every: int, lanes: int
) -> TaylorRuns:
    """Return runs of one kind of scene; their arrays are allocated, for the caller to fill in.

    Parameters
    ----------
    system
        Any system of the kind.
    code
        Machine code of the kind.
    parameters
        Parameters of the method.
    step
        Step of the scene [s].
    every
        Steps from one recorded sample to the next.
    lanes
        Number of runs.
    """
    code_ = taylor_code(code, parameters.order, lanes)
    states, n = layout_of(system).size, len(system.balls)
    clock = aligned((len(CLOCK), lanes))
    clock[LOG_TOLERANCE], clock[STEP], clock[EVERY] = math.log2(parameters.tolerance), step, every
    clock[SHORTEST] = parameters.steps * step if parameters.steps else step / PARTS
    clock[LONGEST] = parameters.steps * step if parameters.steps else math.inf
    clock[ENDS_STEPS] = 1.0
    signals = aligned((STATUS_LINES, lanes))
    signals[SOUND] = 1.0
    width = code.emission.row_channels
    return TaylorRuns(
        prepare=code.address("prepare", lanes),
        coefficients=code_.addresses["coefficients"],
        move=code_.addresses["move"],
        mark=code_.addresses["mark"],
        sample=code_.addresses["sample"],
        record_strided=code_.addresses.get("record", 0),
        record_dense=code_.addresses.get("record_dense", 0),
        c=aligned((code.size, lanes)),
        b=aligned((code.branches(), lanes)),
        place=code.layout.place,
        clock=clock,
        y=aligned((states, lanes)),
        turns=aligned((n, lanes)),
        series=aligned((code_.size * lanes,)),
        state=aligned((states, lanes)),
        bounds=aligned((states, lanes)),
        status=signals,
        row=aligned((width, lanes)),
        nowhere=aligned((width + 2,)),
        sound=signals[SOUND_STEPS],
    )


def run_by_taylor(run: Run, system: System, code: Code, parameters: TaylorParameters) -> TaylorRun:
    """Return a single run by Taylor's method, whose state is in the memory of ``run``.

    Parameters
    ----------
    run
        Run with a memory of ``memory_size`` numbers.
    system
        System to simulate.
    code
        Machine code of its kind of scene.
    parameters
        Parameters of the method.
    """
    lane_runs, states = lanes_of(system, code, parameters, run.step, 1, 1), run.state.size
    memory, column = run.work.memory[0], (-1, 1)
    lane_runs = lane_runs._replace(
        c=run.scene.c.reshape(column),
        b=run.balls.branches.reshape(column),
        y=memory[STATE : STATE + states].reshape(column),
        turns=memory[STATE + states :].reshape(column),
        bounds=run.work.bounds.reshape(column),
    )
    return TaylorRun(run, lane_runs)
