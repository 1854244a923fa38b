"""What parameters change of an impact, in the subset that ``ab_sim.compiling`` translates.

Which balls move as one afterwards is known from the impact itself (``events.impact``); with these
rows the speeds afterwards are smooth functions of those before, and their change is emitted.
"""

from ab_sim.compiling.kinds import call, scratch
from ab_sim.events.balls import around, ball_at, put_branches
from ab_sim.events.impact import SLOW_IMPACT, collide
from ab_sim.events.rows import CLOSED, SHIFT, first_open
from ab_sim.events.run import PATH, evaluate
from ab_sim.stepping.tangent_functions import put_table_change, table_change
from ab_sim.stepping.tangents import Tangents, copy, of_block, put_yields


def carry_over_impact(own: Tangents, now: float, struck: int) -> bool:
    """The changes just after an impact, given those just before; the run stays before it.

    Args:
        own: what steps; ``begin`` of its arrays is how the impact's time changes.
        now: that time, local [s].
        struck: the contact that has closed.

    Returns:
        Whether impulses were found.
    """
    run, balls, work = own.run, own.run.balls, own.run.work
    state, discrete = run.state, run.balls.discrete
    for j in range(state.size):
        own.kept[j] = state[j]
    for i in range(discrete.shape[0]):
        for q in range(discrete.shape[1]):
            own.kept_discrete[i, q] = discrete[i, q]
    found = collide(run, now, struck, False)
    if found:
        put_changes(own, now)
    for j in range(state.size):
        state[j] = own.kept[j]
    for i in range(discrete.shape[0]):
        for q in range(discrete.shape[1]):
            discrete[i, q] = own.kept_discrete[i, q]
    put_branches(balls)
    evaluate(run, now, state, work.slope_ahead)
    return found


def put_changes(own: Tangents, now: float) -> None:
    """The changes after an impact, right after ``collide``, whose branches are in force."""
    run, size = own.run, own.run.state.size
    for i in range(run.balls.number):
        own.shift[i] = run.work.rows[i, SHIFT]
    put_yields(own)
    for block in range(own.blocks):
        for lane in range(own.lanes):
            own.length[block, lane] = 0.0
        put_table_change(own, own.kept, now, block)
        put_shift_change(own, block)
        yields, constants = of_block(own, own.yields, block), of_block(own, own.constants, block)
        shifts = of_block(own, own.shift_change, block)
        c, b, time, along = run.scene.c, run.balls.branches, own.time, own.along
        after, shift = own.rates[0:size], own.shift
        call(
            own.change_impact, c, b, time, own.kept, along, constants, yields, shift, shifts, after
        )
        copy(after, of_block(own, own.change, block))


def put_shift_change(own: Tangents, block: int) -> None:
    """How what the balls bounce changes: see ``impact.shift_speeds``."""
    run, balls, rows = own.run, own.run.balls, own.run.work.rows
    n, lanes, c, b = balls.number, own.lanes, run.scene.c, balls.branches
    shifts, constants = of_block(own, own.shift_change, block), of_block(own, own.constants, block)
    table = balls.table
    begin = first_open(balls, rows)
    parting, met = scratch(1), scratch(1)
    for place in range(n):
        k = around(balls, begin + place)
        i, j = ball_at(balls, k), ball_at(balls, k + 1)
        if place == 0:
            for lane in range(lanes):
                shifts[i, lane] = 0.0
        if place == n - 1:
            break
        met[0] = table[PATH, i] - table[PATH, j]
        bounces = rows[k, CLOSED] != 0.0 and met[0] > SLOW_IMPACT
        if bounces:
            call(run.scene.restitution, c, b, parting, met[0])
            for lane in range(lanes):
                faster = table_change(own, PATH, i, lane) - table_change(own, PATH, j, lane)
                own.approach[0, lane] = faster
            approach, time = own.approach, own.time
            call(own.change_restitution, c, b, time, constants, met, approach, own.parting)
        for lane in range(lanes):
            shifted = shifts[i, lane] if rows[k, CLOSED] != 0.0 else 0.0
            if bounces:
                shifted += parting[0] * own.approach[0, lane] + own.parting[0, lane] * met[0]
            shifts[j, lane] = shifted
