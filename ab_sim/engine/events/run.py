"""Data of a run: the scene's functions, the balls as plain numbers, and work arrays."""

from typing import NamedTuple

from ab_sim.engine.compiling.kinds import Floats, Integers, IntegerTable, Table, call

LOAD, INERTIA, PATH_FORCE, FRICTION, GRIP, PATH, CURVE, ALONG, PATH_ACCELERATION = range(9)
"""Lines of ``BallEvents.table``, with a column for each ball:

- LOAD: normal force without the terms with accelerations [N].
- INERTIA: mu [kg].
- PATH_FORCE: force along the race without accelerations, friction and neighbours [N].
- FRICTION: coefficient of friction with the sign of sliding, 0 if the ball sticks or is not loaded.
- GRIP: coefficient of friction.
- PATH: path speed [m/s].
- CURVE: the race's radius of curvature [m].
- ALONG: length along the race from angle 0, without whole turns [m].
- PATH_ACCELERATION: path acceleration g [m/s^2].
"""
NORMAL, PULL, SIZE = 9, 10, 11
"""Further lines of ``BallEvents.table``:

- NORMAL: normal force N [N].
- PULL: force along the race without neighbours' pushes and static friction [N], PATH_FORCE +
  COUPLING.x - FRICTION N.
- SIZE: sum of the magnitudes of the terms of these forces [N], to which their rounding errors are
  relative.
"""
COUPLING = 12
"""First of K lines COUPLING of ``BallEvents.table``, followed by K lines PRESS. They are the
coefficients of the accelerations x in a ball's equation, with N the race's normal force:

    mu g = PATH_FORCE + COUPLING.x - FRICTION N + pushes of its neighbours,      N = LOAD + PRESS.x
"""
COMMANDED, MOST, SPEED = 0, 1, 2
"""Elements of ``BallEvents.motor``: torque that the speed loop commands and its limit [N m], and
the spindle's speed [rad/s]."""


class SceneFunctions(NamedTuple):
    """Addresses of a scene's emitted functions."""

    prepare: int
    """Function prepare(c), which computes derived constants."""
    evaluate: int
    """Function evaluate(c, b, y, slope, x, motor, table, t), the equations of motion."""
    arrow: int
    """Function arrow(c, b, y, block, t), the equations of deck and spindle."""
    step: int
    """Function step(c, b, y, slope, trial, begin, length), one step from a state with its slope."""
    finish: int
    """Function finish(c, b, y, slope, row, t, t_profile), slope and sample at a step's end."""
    apply_impulse: int
    """Function apply_impulse(c, b, y, jumps, v), which adds jumps of velocity, in the order of x,
    to the deck's velocities in v, an array with the layout of the state."""
    restitution: int
    """Function restitution(c, b, out, approach): separation speed per approach speed [m/s]."""
    c: Floats
    """Constants, including the place on the speed profile."""


class BallEvents(NamedTuple):
    """Balls, their discrete state, and the results of the last evaluation of the equations."""

    number: int
    """Number of balls, n."""
    constants: Table
    """Constants of the balls, ``System.balls``."""
    contacts: Table
    """Constants of the contacts, ``System.contacts``."""
    discrete: IntegerTable
    """Branches that hold between two events, shape (n + 1, DISCRETE_COLUMNS), columns as in
    ``dynamics.system``."""
    branches: Floats
    """Branches in the form that the scene's functions read, see ``balls.put_branches``."""
    table: Table
    """Quantities of the balls, shape (12 + 2 K, n), lines as above."""
    block: Table
    """Equations of deck and spindle with the balls fixed on the race, used at impacts: upper
    triangle of the matrix, and forces in the last column; shape (K, K + 1)."""
    x: Floats
    """Accelerations of deck and spindle, the spindle's last; shape (K,)."""
    motor: Floats
    """Torques and speed of the motor, shape (3,), elements as above."""
    force: Floats
    """Normal force N of the race on each ball [N], a view of the table's line NORMAL."""
    push: Floats
    """Force along the race between the balls at a contact [N]; shape (n,)."""
    accelerations: int
    """Number of accelerations x, K."""
    free: int
    """Number of unknown accelerations: K, or K - 1 if the spindle's is prescribed."""
    first_angle: int
    """Index of theta_0 in the state."""
    first_rate: int
    """Index of theta_0' in the state."""
    spindle: int
    """Index of psi in the state, with a motor; w follows."""
    has_friction: bool
    has_contact: bool
    has_motor: bool
    has_energy_balance: bool


class Workspace(NamedTuple):
    """Arrays that a run reuses, so that steps do not allocate; slots: see ``event_functions``."""

    slope: Floats
    """Slope at a step's start, shape (states,)."""
    trial: Floats
    """State at a step's end, shape (states,)."""
    slope_ahead: Floats
    """Slope at a step's end, shape (states,)."""
    memory: Table
    """Numbers that a stepper carries from one step to the next; all zeros restart it."""
    smooth: Floats
    """Start time of the profile segment to which the memory belongs [s]; NaN if there is none;
    shape (1,)."""
    bounds: Floats
    """Bounds of the states' magnitudes; a run that reaches one has failed; shape (states,)."""
    value: Floats
    """Event functions at a step's start, shape (slots,)."""
    value_ahead: Floats
    """Event functions at a step's end, shape (slots,)."""
    rate: Floats
    """Rates, at a step's start, of functions that are speeds or distances; shape (slots,)."""
    rate_ahead: Floats
    """Rates, at a step's end, of functions that are speeds or distances; shape (slots,)."""
    rounding: Floats
    """Bounds of the event functions' rounding errors at the last evaluation; shape (slots,)."""
    rows: Table
    """Rows of touching balls at an instant, shape (n, WIDTH): see ``rows``."""
    near: Table
    """State ``SHORTLY`` after another one, for forward differences, and its slope; (2, states)."""
    near_value: Table
    """Event functions, rounding errors and rates for ``near``; shape (3, slots)."""
    force_rate: Table
    """Rates of the event functions that are forces, at a step's start and end; shape (2, slots)."""
    measured: Floats
    """Times over which the rates at a step's start and end were measured [s]; 0 if they were not;
    shape (2,)."""
    counts: Integers
    """Number of located events; number of steps with too many events, plus instants without
    consistent branches or impulses; shape (2,)."""


class Run(NamedTuple):
    """All data with which the steps of a drive are taken."""

    scene: SceneFunctions
    balls: BallEvents
    work: Workspace
    """Work arrays; if a state left its bounds, ``trial`` holds it."""
    state: Floats
    """Newest state that is within its bounds."""
    step: float
    """Length of a step [s]."""
    place: int
    """Index of the place on the speed profile in ``SceneFunctions.c``."""
    ball_column: int
    """Index of the first ball's angle in a row.

    A row has the columns of a sample that begin with the spindle's angle.
    """
    quaternion: int
    """Index of the quaternion of a deck in space in the state; -1 for a deck in the plane."""
    has_events: bool
    """True if the scene has set-valued laws, so that steps are searched for events."""


def evaluate(run: Run, time: float, state: Floats, slope: Floats) -> None:
    """Evaluate the equations of motion at a state and a local time [s].

    ``slope``, and ``x``, ``motor`` and ``table`` of the balls are written.
    """
    c, b, balls = run.scene.c, run.balls.branches, run.balls
    call(run.scene.evaluate, c, b, state, slope, balls.x, balls.motor, balls.table, time)


def take_step(run: Run, begin: float, length: float) -> None:
    """Take one step from the state, whose slope is known, and write the result to ``trial``.

    Parameters
    ----------
    run
        Equations, state and workspace.
    begin
        Local time at the beginning of the step [s].
    length
        Length of the step [s].
    """
    c, b, work = run.scene.c, run.balls.branches, run.work
    call(run.scene.step, c, b, run.state, work.slope, work.trial, begin, length)
