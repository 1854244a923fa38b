"""Taylor steps of one run along a speed profile; the scene's fixed steps are samples of them.

Steps do not depend on how a run is divided into calls: the beginning of the current step and the
state there are in the run's memory, and the step's series is computed from them. No step extends
beyond the end of a profile segment. After a kink or a command, the next step begins at the present
sample.
"""

from ab_sim.engine.compiling.kinds import Table
from ab_sim.engine.stepping.fixed_step import (
    ANGLE,
    PLACE_UNTIL,
    EqualSteps,
    enter_step_range,
    local_time,
    put_labels,
    step_by_step,
    steps_in,
)
from ab_sim.engine.taylor.clock import (
    ANEW,
    BEGIN,
    COUNT,
    FIRST,
    LENGTH,
    LOCAL,
    OFFSET,
    SOUND,
    START,
    TO,
    UNTIL,
)
from ab_sim.engine.taylor.run import BEGAN, VALID, TaylorRun, aim, expand, next_samples, renew
from ab_sim.model.dynamics.system import TURNS


def advance_by_taylor(
    one: TaylorRun,
    step_plan: Table,
    at: int,
    first: int,
    steps: int,
    command: float,
    samples: Table,
) -> int:
    """Take steps along a step plan by Taylor's method: see ``fixed_step.advance``."""
    run = one.run
    only_record = steps == 0 and samples.shape[0] > 0
    done, sound = 0, True
    while sound and at < step_plan.shape[0]:
        step_range = enter_step_range(run, step_plan[at], first + done, only_record)
        here, count = steps_in(step_plan[at], first + done, steps - done)
        if count > 0:
            begin(one, step_range, step_plan[at, step_plan.shape[1] - PLACE_UNTIL], count)
            taken = take_range(one, samples[done : samples.shape[0]], count)
        else:
            taken = step_by_step(run, step_range, samples, 0)
        sound = taken == count
        done += here if sound else taken
        if done == steps:
            break
        at += 1
    put_labels(run, samples, first if only_record else first + 1, command)
    return done if sound else -1 - done


def begin(one: TaylorRun, step_range: EqualSteps, until: float, count: int) -> None:
    """Continue the step in memory; without one, begin a step at the present state."""
    run, lane_runs = one.run, one.own
    clock, memory, balls = lane_runs.clock, run.work.memory, run.balls
    clock[START, 0], clock[OFFSET, 0] = step_range.start, step_range.offset
    clock[LENGTH, 0], clock[UNTIL, 0] = step_range.length, until
    clock[FIRST, 0], clock[COUNT, 0] = float(step_range.first), float(count)
    if memory[0, VALID] == 0.0:
        for j in range(run.state.size):
            lane_runs.state[j, 0] = run.state[j]
        for i in range(balls.number):
            lane_runs.turns[i, 0] = float(balls.discrete[i, TURNS])
        clock[ANEW, 0], clock[TO, 0] = 1.0, local_time(run, step_range, 0)
        renew(lane_runs)
    else:
        # Memory has the step's begin and the state there, but no series. The same state gives the
        # same series to the last bit.
        clock[BEGIN, 0] = memory[0, BEGAN]
        expand(lane_runs)
    clock[LOCAL, 0] = clock[BEGIN, 0]
    aim(lane_runs, 0)


def take_range(one: TaylorRun, samples: Table, count: int) -> int:
    """Take the steps of a range; return their number, fewer if the state left its bounds."""
    run, lane_runs, balls = one.run, one.own, one.run.balls
    for done in range(count):
        next_samples(lane_runs, samples[done, ANGLE:])
        if lane_runs.said[SOUND, 0] == 0.0:
            lane_runs.said[SOUND, 0] = 1.0
            for j in range(run.state.size):
                run.work.trial[j] = lane_runs.state[j, 0]
            return done
        for j in range(run.state.size):
            run.state[j] = lane_runs.state[j, 0]
        for i in range(balls.number):
            balls.discrete[i, TURNS] = int(lane_runs.turns[i, 0])
    run.work.memory[0, VALID], run.work.memory[0, BEGAN] = 1.0, lane_runs.clock[BEGIN, 0]
    return count
