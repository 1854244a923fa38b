"""What collocation works with: a scene's functions, the method's numbers, tables, and arrays.

N is the number of nodes, R that of equations of second order and of what else is integrated. The
equations' left-hand sides x'' + c x' + k x are what tables of responses are made for.
"""

from typing import NamedTuple

from ab_sim.collocation.nodes import CollocationNodes
from ab_sim.compiling.kinds import Cube, Floats, Table
from ab_sim.dynamics.system import DIRECTION
from ab_sim.events.run import Run

LENGTH, SAMPLES, TAKEN, BEGIN, MOVED, STEP, AHEAD, WAIT = 0, 1, 2, 3, 4, 5, 6, 7
GOOD, REST, AT_ONCE, SINCE = 8, 9, 10, 11
HEAD = 12
"""The memory's head: the step's length [s]; how many samples there are in it, and how many have
been taken; local time of its beginning [s]; the angle that the rotor's axes make in it [rad]; from
one sample to the next [s]; how long the next step is, in parts of that; steps to wait before a
longer one is tried. Then of events: how many samples of the step are before any; how many samples
are still to be reached by the other stepper; how many were, when it last took over; how many have
been reached by collocation since then. And how many numbers this head has."""
TIME, PROFILE_TIME, INSIDE = 0, 1, 2
"""Lines behind those of states: local time [s]; the time at which to look on the profile; whether
the state is within its bounds, 1 or 0."""
STRIDE = 3
"""Numbers of such a line are so many times as many as there are nodes."""
CHANGED, TURNED, SCALE, SPINDLE_SCALE, ERROR, WITHIN, TURN = 0, 1, 2, 3, 4, 5, 6
"""Of the results: how far an iteration has changed f of the deck, and of all others, as angles
[rad]; what makes angles of the deck's x, and of the spindle's; the errors of the samples and within
the step [rad]; the angle that the rotor's axes make in it [rad]."""
RESULTS = 7
NEXT, LATEST, NEXT_RATIO, LATEST_RATIO = 0, 1, 2, 3
"""Of the tables' head: which of the sets kept is to go next; the first table of the set asked for
last; the same two of the matrices that carry polynomials on."""
NODE, SHARE, COEFFICIENTS = 0, 1, 2
"""Of the method's lines: c_j, the weights of the quadrature, and N columns of a matrix to the last
coefficients."""


class CollocationFunctions(NamedTuple):
    """Emitted functions, by their addresses; see ``ab_sim.collocation``."""

    start: int
    iterate: int
    iterate_near: int
    judge: int
    keep: int
    sample: int
    begin: int
    rows: int
    evaluate: int
    take_node: int


class CollocationMethod(NamedTuple):
    """What a step is made with, whatever the scene."""

    nodes: CollocationNodes
    lines: Table
    """Shape (2 + N, N), lines as above."""
    bounds: Cube
    """``nodes.bounds_within_pieces``."""
    tolerance: float
    """What each step may leave of an error [rad]."""
    steps: float
    """Of the scene, that a collocation step goes over; 0 for as many as the tolerance allows."""
    reach: float
    """Rates times steps at which the other stepper leaves as much of an error."""


class ResponseTables(NamedTuple):
    """Tables of responses, set by set.

    Of a set those up to the nodes, then those up to the samples, N at a time; each for every
    left-hand side, and for what is only integrated.
    """

    lines: Table
    """Shape (tables * lines_of_table(N), N)."""
    numbers: Table
    """Shape (tables, NUMBERS)."""
    head: Floats
    """Shape (4,), see above."""
    carry: Table
    """Matrices that carry values at the nodes on into a step so many times as long, column by
    column; shape (matrices * N, N)."""
    ratios: Floats
    """How many times as long, of each of them; shape (matrices,)."""
    groups: int
    """Of samples, for which a set has room."""
    kept: int
    """How many sets there are."""


class Buffers(NamedTuple):
    """What is written in lanes: of N instants side by side."""

    work: Table
    """Of the iterations, shape (lines, N); f first, R lines."""
    states: Floats
    """States of samples that are to be recorded, with their times and INSIDE: lines of 3 N numbers,
    of which N in the middle are samples, so that N others may be written beside any of them."""
    at_nodes: Floats
    """The same of states at the nodes."""
    turns: Floats
    """Whole turns taken out of the balls' angles, and the spindle's; shape (n + 1,)."""
    nodes: Table
    """What the equations say at the nodes, with events: state, slope, accelerations, motor, table
    of the balls; shape (N, columns)."""
    values: Table
    """Event functions there, shape (N, slots)."""


class CollocationRun(NamedTuple):
    """A Run whose steps are collocation steps; ``Run.scene.step`` is the other stepper's."""

    run: Run
    functions: CollocationFunctions
    method: CollocationMethod
    tables: ResponseTables
    linear: Floats
    """c [1/s] and k [1/s^2] of each left-hand side; then, of a deck in space, matrices from its
    modes and to them, line by line; shape (2 sides,) or (2 sides + 98,)."""
    buffers: Buffers
    result: Floats
    """Shape (RESULTS,), see above."""
    sides: int
    """How many different left-hand sides there are; that of a motor's spindle is the last."""
    rows: int
    """R."""


def memory_of(own: CollocationRun) -> Floats:
    """What belongs to the state.

    f at the nodes of the step at hand, R lines; the state at its beginning; the head.
    """
    return own.run.work.memory[0]


def size_of_memory(nodes: int, rows: int, states: int) -> int:
    """How many numbers that is."""
    return nodes * rows + states + HEAD


def begun_of(own: CollocationRun) -> Floats:
    """The state at the beginning of the step at hand."""
    first = own.method.nodes.at.size * own.rows
    return own.run.work.memory[0][first : first + own.run.state.size]


def head_of(own: CollocationRun) -> Floats:
    """The memory's head."""
    first = own.method.nodes.at.size * own.rows + own.run.state.size
    return own.run.work.memory[0][first : first + HEAD]


def is_limited(own: CollocationRun) -> bool:
    """Whether a motor gives all it can: its speed loop is open then."""
    balls = own.run.balls
    return balls.has_motor and balls.discrete[balls.number, DIRECTION] != 0
