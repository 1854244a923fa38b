"""How event functions change with parameters, in the subset that ``ab_sim.compiling`` translates.

They are those of ``events.event_functions``, in their slots, differentiated by hand: sums and
products of what the equations' table holds, whose changes are emitted.
"""

import math

from ab_sim.compiling.kinds import Floats, call
from ab_sim.dynamics.system import DIRECTION, FIRST_TURNS, JOINED, LOADED, TURNS
from ab_sim.events.balls import around, ball_at, moves_along, row_start
from ab_sim.events.event_functions import LOAD, MOTOR, SLIDE, TOUCH, leans
from ab_sim.events.run import (
    ALONG,
    COUPLING,
    FRICTION,
    GRIP,
    INERTIA,
    PATH_ACCELERATION,
    PATH_FORCE,
)
from ab_sim.events.run import LOAD as LOAD_LINE
from ab_sim.stepping.tangents import Tangents, copy, of_block, put_yields

OVERLAP = 5
"""Kind of ``Tangents.trouble``: balls that touch at the start would not, or would overlap."""
TOUCHING = 1e-9
"""Share of its parts that a gap's change may be, of balls that touch whatever changes."""


def put_table_change(own: Tangents, state: Floats, time: float, block: int) -> None:
    """``at_event`` of a block at a state, where ``begin + length`` is how the time changes."""
    run, size = own.run, own.run.state.size
    own.time[0], own.time[1] = time, time
    copy(of_block(own, own.change, block), own.along)
    for lane in range(own.lanes):
        own.along[size, lane] = own.begin[block, lane] + own.length[block, lane]
        own.along[size + 1, lane] = 0.0
    yields, constants = of_block(own, own.yields, block), of_block(own, own.constants, block)
    c, b, along = run.scene.c, run.balls.branches, own.along
    call(own.change_table, c, b, own.time, state, along, constants, yields, own.at_event)


def table_change(own: Tangents, line: int, i: int, lane: int) -> float:
    """Of an entry of ``BallEvents.table``."""
    balls = own.run.balls
    return own.at_event[balls.accelerations + 3 + line * balls.number + i, lane]


def function_change(own: Tangents, slot: int, block: int, lane: int) -> float:
    """Of the event function ``slot``, in a column; after ``put_table_change`` of its block."""
    balls, n = own.run.balls, own.run.balls.number
    if slot >= MOTOR * n:
        return motor_change(own, slot - MOTOR * n, lane)
    kind, i = slot // n, slot % n
    if kind == TOUCH:
        if balls.discrete[i, JOINED] == 0:
            return gap_change(own, i, block, lane)
        return push_change(own, i, lane)
    if kind == LOAD:
        force = normal_force_change(own, i, lane)
        return force if balls.discrete[i, LOADED] == 1 else -force
    direction = balls.discrete[i, DIRECTION]
    if direction != 0:
        return direction * of_block(own, own.change, block)[balls.first_rate + i, lane]
    return left_change(own, kind, i, lane)


def motor_change(own: Tangents, which: int, lane: int) -> float:
    """Of MOTOR."""
    balls = own.run.balls
    asked = own.at_event[balls.accelerations, lane]
    most = own.at_event[balls.accelerations + 1, lane]
    limited = balls.discrete[balls.number, DIRECTION]
    if limited != 0:
        return limited * asked - most
    return most + asked if which == 0 else most - asked


def normal_force_change(own: Tangents, i: int, lane: int) -> float:
    """Of the race's force on ball i [N], see ``reactions.put_normal_forces``."""
    balls = own.run.balls
    force = table_change(own, LOAD_LINE, i, lane)
    for r in range(balls.accelerations):
        line = COUPLING + balls.accelerations + r
        force += table_change(own, line, i, lane) * balls.x[r]
        force += balls.table[line, i] * own.at_event[r, lane]
    return force


def pull_change(own: Tangents, i: int, lane: int) -> float:
    """Of ``reactions.path_force_less_friction`` [N]."""
    balls = own.run.balls
    pull = table_change(own, PATH_FORCE, i, lane)
    for r in range(balls.accelerations):
        line = COUPLING + r
        pull += table_change(own, line, i, lane) * balls.x[r]
        pull += balls.table[line, i] * own.at_event[r, lane]
    if balls.has_friction:
        pull -= table_change(own, FRICTION, i, lane) * balls.force[i]
        pull -= balls.table[FRICTION, i] * normal_force_change(own, i, lane)
    return pull


def left_change(own: Tangents, kind: int, i: int, lane: int) -> float:
    """Of SLIDE or HOLD of a stuck ball, with the stuck balls that lean on it."""
    balls, total = own.run.balls, own_left_change(own, kind, i, lane)
    if not balls.has_contact:
        return total
    place = 0
    while ball_at(balls, place) != i:
        place += 1
    for _ in range(balls.number - 1):
        k = around(balls, place - 1) if kind == SLIDE else place
        if not leans(balls, k):
            break
        place = around(balls, place - 1 if kind == SLIDE else place + 1)
        total += own_left_change(own, kind, ball_at(balls, place), lane)
    return total


def own_left_change(own: Tangents, kind: int, i: int, lane: int) -> float:
    """Of the friction that is left of a stuck ball by itself [N]."""
    balls = own.run.balls
    grip = table_change(own, GRIP, i, lane) * max(balls.force[i], 0.0)
    if balls.force[i] > 0.0:
        grip += balls.table[GRIP, i] * normal_force_change(own, i, lane)
    pull = pull_change(own, i, lane)
    return grip + pull if kind == SLIDE else grip - pull


def gap_change(own: Tangents, k: int, block: int, lane: int) -> float:
    """Of the distance between the balls at contact k [m], see ``balls.gap``."""
    balls = own.run.balls
    i, j = ball_at(balls, k), ball_at(balls, k + 1)
    apart = table_change(own, ALONG, j, lane) - table_change(own, ALONG, i, lane)
    return apart + seam_change(own, k, block, lane)


def seam_change(own: Tangents, k: int, block: int, lane: int) -> float:
    """Of what turns and the balls' radii add to that [m]."""
    balls = own.run.balls
    i, j = ball_at(balls, k), ball_at(balls, k + 1)
    turns = (balls.discrete[j, TURNS] - balls.constants[j, FIRST_TURNS]) - (
        balls.discrete[i, TURNS] - balls.constants[i, FIRST_TURNS]
    )
    if k == balls.number - 1:
        turns += 1.0
    radius = of_block(own, own.constants, block)[own.race_radius + j, lane]
    return 2.0 * math.pi * turns * radius - of_block(own, own.spacing, block)[k, lane]


def push_change(own: Tangents, k: int, lane: int) -> float:
    """Of the push between the balls at contact k [N], see ``reactions.put_pushes``."""
    balls, n, push = own.run.balls, own.run.balls.number, 0.0
    begin = row_start(balls)
    for place in range(n):
        here = around(balls, begin + place)
        if moves_along(balls, here):
            i = ball_at(balls, here)
            push += pull_change(own, i, lane)
            push -= table_change(own, INERTIA, i, lane) * balls.table[PATH_ACCELERATION, i]
            push -= balls.table[INERTIA, i] * table_change(own, PATH_ACCELERATION, i, lane)
        else:
            push = 0.0
        if here == k:
            return push
    return push


def touch_anyhow(own: Tangents, time: float) -> bool:
    """Whether balls that touch at the start do whatever changes; right after ``evaluate``."""
    balls, n = own.run.balls, own.run.balls.number
    put_yields(own)
    for block in range(own.blocks):
        put_table_change(own, own.run.state, time, block)
        for k in range(n):
            for lane in range(own.lanes):
                i, j = ball_at(balls, k), ball_at(balls, k + 1)
                parts = abs(table_change(own, ALONG, i, lane))
                parts += abs(table_change(own, ALONG, j, lane))
                parts += abs(of_block(own, own.spacing, block)[k, lane])
                opens = abs(gap_change(own, k, block, lane)) > TOUCHING * parts
                if balls.discrete[k, JOINED] == 1 and opens:
                    own.trouble[0], own.trouble[1] = OVERLAP, k
                    own.trouble[3] = block * own.lanes + lane
                    return False
    return True
