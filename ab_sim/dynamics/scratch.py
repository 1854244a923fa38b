"""Columns of the scratch array in which one evaluation keeps what it knows of each ball."""

COS, SIN = 0, 1
"""of theta."""
LOAD = 2
"""m R p^2 [N]: the normal force but for the deck's acceleration."""
FORCE = 3
"""Force of the effects along the race, friction left out [N]."""
INERTIA = 4
"""mu = m + I/a^2 [kg]."""
FRICTION = 5
"""Coefficient of friction with the sign of theta'; 0 where the race carries no load."""
ACCELERATION = 6
"""q = al + theta'' [rad/s^2]."""
WIDTH = 7
