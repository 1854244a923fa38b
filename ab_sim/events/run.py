"""What a run works with: the scene's functions, the balls as plain numbers, and arrays."""

from typing import NamedTuple

from ab_sim.compiling.kinds import Floats, Integers, IntegerTable, Table, call

LOAD, INERTIA, PATH_FORCE, FRICTION, GRIP, PATH, CURVE, ALONG, PATH_ACCELERATION = range(9)
"""Lines of ``BallEvents.table``, a column for each ball: normal force but for the accelerations
[N]; mu [kg]; force along the race but for accelerations, friction and neighbours [N]; coefficient
of friction with the sign of sliding, 0 where the ball sticks or is unloaded; coefficient of
friction; path speed [m/s]; the race's radius of curvature [m]; length along the race from angle 0,
whole turns left out [m]; path acceleration g [m/s^2]."""
NORMAL, PULL, SIZE = 9, 10, 11
"""Further lines: the normal force N [N]; force along the race but for a ball's neighbours' pushes,
and for friction that holds it [N]; sum of the magnitudes of what these are made of, of which
rounding is a part [N]."""
COUPLING = 12
"""The first of K lines; K of PRESS follow. With N the race's normal force,

    mu g = PATH_FORCE + COUPLING.x - FRICTION N + pushes of its neighbours,      N = LOAD + PRESS.x
"""
ASKED, MOST, SPEED = 0, 1, 2
"""Of ``BallEvents.motor``: torque that its speed loop asks for, the most that it gives [N m], and
the spindle's speed [rad/s]."""


class SceneFunctions(NamedTuple):
    """A scene's own functions, by their addresses."""

    prepare: int
    """prepare(c): constants that follow from others."""
    evaluate: int
    """evaluate(c, b, y, slope, x, motor, table, t): the equations of motion."""
    arrow: int
    """arrow(c, b, y, block, t): the equations of what carries the balls."""
    step: int
    """step(c, b, y, slope, trial, begin, length): one step from a state whose slope is known."""
    finish: int
    """finish(c, b, y, slope, row, t, t_profile): slope and sample."""
    apply_impulse: int
    """apply_impulse(c, b, y, jumps, v): adds jumps of velocity, in the order of x, to the deck's in
    v, where they lie as in the state."""
    restitution: int
    """restitution(c, b, out, approach): speed of parting per speed of approach [m/s]."""
    c: Floats
    """Constants, and the place on the speed profile."""


class BallEvents(NamedTuple):
    """Balls, what holds of them, and what the last evaluation of the equations said."""

    number: int
    """n."""
    constants: Table
    """``System.balls``."""
    contacts: Table
    """``System.contacts``."""
    discrete: IntegerTable
    """The branches that hold between two events, shape (n + 1, DISCRETE_COLUMNS), columns as in
    ``dynamics.system``."""
    branches: Floats
    """The same as the scene reads it, see ``balls.put_branches``."""
    table: Table
    """Shape (12 + 2 K, n), lines as above."""
    block: Table
    """Equations of what carries the balls, these held on the race: upper triangle of the matrix,
    and forces in the last column; shape (K, K + 1). At impacts."""
    x: Floats
    """Its accelerations, the spindle's last; shape (K,)."""
    motor: Floats
    """Shape (3,)."""
    force: Floats
    """N, the race's normal force on each ball [N]: the table's line NORMAL."""
    push: Floats
    """Force along the race between the balls at a contact [N]; shape (n,)."""
    accelerations: int
    """K."""
    free: int
    """How many of them are solved for: K, or K - 1 where the spindle's is prescribed."""
    first_angle: int
    """Where in the state theta_0 lies."""
    first_rate: int
    """Where in the state theta_0' lies."""
    spindle: int
    """Where in the state psi lies, with a motor; w follows."""
    has_friction: bool
    has_contact: bool
    has_motor: bool
    has_energy_balance: bool


class Workspace(NamedTuple):
    """Arrays that a run reuses, so that no step allocates; slots: see ``event_functions``."""

    slope: Floats
    """Of the state at a step's start, shape (states,)."""
    trial: Floats
    """The state at its end, shape (states,)."""
    slope_ahead: Floats
    """The slope there, shape (states,)."""
    memory: Table
    """What a stepper carries from one step to the next; it starts anew where that is zero."""
    smooth: Floats
    """When the piece of the profile begins that the memory belongs to [s]; NaN if it belongs to
    none; shape (1,)."""
    bounds: Floats
    """Magnitudes that no sound run reaches, shape (states,)."""
    value: Floats
    """Event functions at a step's start, shape (slots,)."""
    value_ahead: Floats
    """The same at its end."""
    rate: Floats
    """Rates at its start of those that are speeds or distances, shape (slots,)."""
    rate_ahead: Floats
    """The same at its end."""
    rounding: Floats
    """What of an event function may be rounding, shape (slots,)."""
    rows: Table
    """Balls that touch, at an instant, shape (n, WIDTH): see ``rows``."""
    near: Table
    """A state shortly after another, and its slope; shape (2, states)."""
    near_value: Table
    """Event functions, rounding and rates there; shape (3, slots)."""
    force_rate: Table
    """Rates of the event functions that are forces, at a step's start and end; shape (2, slots)."""
    measured: Floats
    """How long after a step's start and end these rates were measured [s]; 0 where they were not;
    shape (2,)."""
    counts: Integers
    """Events met; steps with events too many to locate and instants at which no branches were found
    for all laws; shape (2,)."""


class ImplicitWork(NamedTuple):
    """What an implicit step works with, see ``stepping.implicit``; empty arrays without one."""

    slope: int
    """slope(c, b, y, k, time), emitted."""
    tangent: int
    """tangent(c, b, t, y, d, out), emitted."""
    mass: float
    """am, where between the ends y' is taken."""
    force: float
    """af, where f is."""
    newmark: float
    """gamma."""
    time: Floats
    """Shape (1,)."""
    at: Floats
    """A state, shape (states,)."""
    slope_there: Floats
    """Its slope."""
    change: Floats
    """d, shape (states,)."""
    along: Table
    """Directions and the change of time, shape (states + 1, lanes)."""
    rates: Table
    """What they make of the slope, shape (states, lanes)."""
    jacobian: Table
    """Shape (states, states)."""
    equations: Table
    """The matrix of Newton's corrections, and the right-hand side; shape (states, states + 1)."""


class Run(NamedTuple):
    """All of it: what the steps of a drive are taken with."""

    scene: SceneFunctions
    balls: BallEvents
    work: Workspace
    """Where ``trial`` holds the state that left its bounds, if one did."""
    state: Floats
    """The last good state."""
    step: float
    """s."""
    place: int
    """Where in ``SceneFunctions.c`` the place on the speed profile begins."""
    ball_column: int
    """Where in a row, a sample from its spindle angle on, the first ball's angle lies."""
    quaternion: int
    """Where in the state that of a deck in space lies; -1 without one."""
    has_events: bool
    """Whether there are set-valued laws."""
    is_implicit: bool
    """Whether steps are those of ``stepping.implicit``."""
    implicit: ImplicitWork


def evaluate(run: Run, time: float, state: Floats, slope: Floats) -> None:
    """The equations of motion at a state, local time [s]; x, motor and table go with it."""
    c, b, balls = run.scene.c, run.balls.branches, run.balls
    call(run.scene.evaluate, c, b, state, slope, balls.x, balls.motor, balls.table, time)


def take_step(run: Run, begin: float, length: float) -> None:
    """One step from the state, whose slope is known, into ``trial``; local time [s]."""
    c, b, work = run.scene.c, run.balls.branches, run.work
    call(run.scene.step, c, b, run.state, work.slope, work.trial, begin, length)
