"""What steps of a run make of changes of its parameters: the arrays, and one step.

In the subset of Python that ``ab_sim.compiling`` translates. *Changes* of the state per parameter,
a column each, are derivatives of the numbers that the steps compute, not of the motion that they
approximate: all stages of a step are differentiated, with the times at which it begins and ends
where these move (Griewank and Walther, Evaluating Derivatives (2008), ch. 3).
"""

from typing import NamedTuple

from ab_sim.compiling.kinds import Floats, Integers, IntegerTable, Table, call, fma
from ab_sim.events.balls import is_stuck
from ab_sim.events.run import Run


class Tangents(NamedTuple):
    """A run, its equations' derivatives, and the changes of its state.

    Numbers of columns lie in blocks of ``lanes``, block under block. The last column is the clock,
    where there are events: what a longer step makes of its end.
    """

    run: Run
    slope: int
    """Emitted: slope(c, b, y, k, time)."""
    change_step: int
    change_row: int
    change_table: int
    change_impact: int
    change_restitution: int
    """Emitted: see ``kernels.tangent``."""
    rolling: int
    """Where in c the balls' rolling masses begin, and"""
    race_radius: int
    """R of their races."""
    blocks: int
    lanes: int
    clock: int
    """Which column; -1 without events."""
    a: Table
    weights: Floats
    nodes: Floats
    """The Butcher tableau."""
    at: Table
    """States of the stages, shape (stages, states)."""
    slopes: Table
    """The slopes there."""
    sums: Table
    """Weighted sums of these: of each stage, and of the step; shape (stages + 1, states)."""
    change: Table
    """Of the state, shape (blocks * states, lanes)."""
    constants: Table
    """Of the raw constants and the place, shape (blocks * constants, lanes)."""
    yields: Table
    """Of how each ball, or its row, yields to forces, as a share; shape (blocks * n, lanes)."""
    spacing: Table
    """Of ``BallEvents.contacts``' distances, shape (blocks * contacts, lanes)."""
    begin: Table
    """Of the local time at which a step begins, shape (blocks, lanes)."""
    length: Table
    """Of a step's length, likewise."""
    rest: Table
    """Of what is left of a step, likewise."""
    time: Floats
    """Local time, and on the profile; shape (2,)."""
    along: Table
    """One block's direction, shape (states + 2, lanes)."""
    rates: Table
    """Of each stage, one below the other, shape (stages * states, lanes)."""
    at_event: Table
    """What ``change_table`` writes, shape (.., lanes)."""
    event_rate: Table
    """Of the event function, shape (blocks, lanes)."""
    shift: Floats
    """Of each ball at an impact, see ``events.impact``; shape (n,)."""
    shift_change: Table
    """Shape (blocks * n, lanes)."""
    approach: Table
    """Of the speed at which two balls meet, shape (1, lanes)."""
    parting: Table
    """Of the coefficient of restitution, likewise."""
    kept: Floats
    """A state, shape (states,)."""
    kept_discrete: IntegerTable
    """``BallEvents.discrete``, likewise."""
    wanted: Integers
    """Numbers of the samples whose changes are wanted, rising; one more that never comes."""
    row_change: Table
    """These, shape (wanted * blocks * channels, lanes)."""
    channels: int
    """In a row."""
    cursor: Integers
    """How many have been written; shape (1,)."""
    trouble: Integers
    """Why there is no derivative (0: there is), of which ball or contact, after how many steps, in
    which column; shape (4,)."""


def of_block(own: Tangents, table: Table, block: int) -> Table:
    """A block's lines of a table of all."""
    lines = table.shape[0] // own.blocks
    return table[block * lines : (block + 1) * lines]


def copy(of: Table, into: Table) -> None:
    """Copy a table into one, or into its first lines."""
    for i in range(of.shape[0]):
        for j in range(of.shape[1]):
            into[i, j] = of[i, j]


def put_yields(own: Tangents) -> None:
    """How mobilities change, in the branches that are in force: 1 over the inertia of a row."""
    balls, n = own.run.balls, own.run.balls.number
    if not (balls.has_friction or balls.has_contact):
        return
    for block in range(own.blocks):
        yields, constants = of_block(own, own.yields, block), of_block(own, own.constants, block)
        for i in range(n):
            for lane in range(own.lanes):
                yields[i, lane] = 0.0
            for j in range(n):
                share = row_share(own, i, j)
                if share != 0.0:
                    for lane in range(own.lanes):
                        yields[i, lane] -= share * constants[own.rolling + j, lane]


def row_share(own: Tangents, i: int, j: int) -> float:
    """1 over the inertia of a row that moves as one, if both balls are in it; else 0 [1/kg]."""
    balls, n = own.run.balls, own.run.balls.number
    if balls.has_contact:
        return balls.branches[n + n * i + j]
    return balls.branches[n + i] if i == j else 0.0


def hold_stuck(own: Tangents) -> None:
    """What friction holds has the speed 0, whatever changes."""
    balls = own.run.balls
    for i in range(balls.number):
        if is_stuck(balls, i):
            for block in range(own.blocks):
                change = of_block(own, own.change, block)
                for lane in range(own.lanes):
                    change[balls.first_rate + i, lane] = 0.0


def carry(own: Tangents, begin: float, length: float) -> None:
    """What one step from the run's state makes of its changes."""
    run, size, lanes = own.run, own.run.state.size, own.lanes
    stages, state = own.weights.size, own.run.state
    c, b = run.scene.c, run.balls.branches
    put_yields(own)
    for i in range(stages + 1):
        for j in range(size):
            total = 0.0
            for q in range(i):
                weight = own.weights[q] if i == stages else own.a[i, q]
                if weight != 0.0:
                    total = fma(weight, own.slopes[q, j], total)
            own.sums[i, j] = total
            if i < stages:
                own.at[i, j] = fma(length, total, state[j])
        if i < stages:
            when = fma(own.nodes[i], length, begin)
            call(own.slope, c, b, own.at[i], own.slopes[i], when)
    if own.clock >= 0:
        block, lane = own.clock // lanes, own.clock % lanes
        own.begin[block, lane], own.length[block, lane] = 0.0, 1.0
        clock = of_block(own, own.change, block)
        for j in range(size):
            clock[j, lane] = 0.0
    for block in range(own.blocks):
        change = of_block(own, own.change, block)
        yields, constants = of_block(own, own.yields, block), of_block(own, own.constants, block)
        lasts, starts = own.length[block], own.begin[block]
        call(
            own.change_step, c, b, own.time, own.at, own.sums, change, lasts, starts, constants,
            yields, own.along, own.rates, begin, length,
        )  # fmt: skip
