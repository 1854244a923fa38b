"""Columns of the table in which one evaluation keeps what it knows of each ball.

The path speed of a ball is its centre's speed along the race, its path acceleration g that
speed's rate of change; both relative to the race. With x the K accelerations of what carries the
balls, the spindle's being the last, and N the race's normal force, each ball obeys

    mu g = PULL + REACH.x - FRICTION N + pushes of its neighbours,      N = LOAD + PRESS.x

and elimination leaves g = FREE + GAIN.x. REACH, PRESS and GAIN are K columns each, one after the
other. What carries the balls feels m times their acceleration: -REACH g of what is along the race.
"""

COS, SIN = 0, 1
"""(cos, sin) is the race's outward normal at the ball, on the carrier's axes."""
LOAD = 2
"""Normal force but for the accelerations x [N]."""
INERTIA = 3
"""mu = m + I/a^2 [kg]."""
PULL = 4
"""Force along the race but for the accelerations, friction and the neighbours [N]."""
FRICTION = 5
"""Coefficient of friction with the sign of sliding; 0 where the ball sticks or is unloaded."""
GRIP = 6
"""Coefficient of friction."""
PATH = 7
"""Path speed [m/s]."""
NORMAL, ACROSS = 8, 9
"""The ball's place from the shaft, along and across the race's normal [m]: runout only."""
CURVE, BEND = 10, 11
"""Radius of curvature l of the race, and dl/dtheta [m]: runout and contact only."""
ALONG = 12
"""Length along the race from angle 0 to the ball [m], whole turns left out: contact only."""
PATH_ACCELERATION = 13
"""g [m/s^2]."""
FORCE = 14
"""Force of the race on the ball against its outward normal, N [N]: see reactions."""
PUSH = 15
"""Force along the race between the ball at this place of the row and the next [N]."""
LEADER = 16
"""The ball that leads the row that this one moves with, itself if alone; -1 if it sticks."""
TOTAL = 17
"""Of a leader, the row's inertia [kg]."""
FREE = 18
"""g where the accelerations x that are solved for vanish [m/s^2]."""
REACH = 19
"""First of K columns; PRESS and GAIN follow."""


def table_width(accelerations: int) -> int:
    """How many columns there are for K accelerations."""
    return REACH + 3 * accelerations
