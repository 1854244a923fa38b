"""Columns of the scratch array in which one evaluation keeps what it knows of each ball.

The path speed of a ball is its centre's speed along the race, its path acceleration g that
speed's rate of change; both relative to the race. Each ball obeys, with x = (A1, A2, al),

    mu g = PULL + (ROW1, ROW2, ROW3).x + pushes of its neighbours,

and elimination leaves g = (GAIN0 + GAIN1 A1 + GAIN2 A2 + GAIN3 al).
"""

COS, SIN = 0, 1
"""of theta; (cos, sin) is the race's outward normal at the ball."""
LOAD = 2
"""Normal force but for the accelerations of deck and spindle [N]."""
INERTIA = 3
"""mu = m + I/a^2 [kg]."""
LEVER = 4
"""What the spindle's acceleration asks of the ball along the race [kg m]."""
FRICTION = 5
"""Coefficient of friction with the sign of sliding; 0 where the ball sticks or is unloaded."""
PULL = 6
ROW1, ROW2, ROW3 = 7, 8, 9
GAIN0, GAIN1, GAIN2, GAIN3 = 10, 11, 12, 13
PATH = 14
"""Path speed [m/s]."""
NORMAL, ACROSS = 15, 16
"""The ball's place from the shaft, along and across the race's normal [m]: runout only."""
CURVE, BEND = 17, 18
"""Radius of curvature l of the race, and dl/dtheta [m]: runout only."""
PATH_ACCELERATION = 19
"""g [m/s^2]."""
FORCE = 20
"""Force of the race on the ball against its outward normal, N [N]: see reactions."""
PUSH = 21
"""Force along the race between the ball at this place of the row and the next [N]."""
LEADER = 22
"""The ball that leads the row that this one moves with, itself if alone; -1 if it sticks."""
TOTAL = 23
"""Of a leader, the row's inertia [kg]."""
DRAG = 24
"""Force along the race per path speed [N s/m]: drag_response only."""
WIDTH = 25
