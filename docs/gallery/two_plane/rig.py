"""The rig of 2010: its tables, as a rotor."""

import math
from typing import NamedTuple

from gallery.two_plane.rotor import Bearing, RigidRotor

RPM = math.pi / 30.0
"""[rad/s] per rpm."""
MASS, RADIUS, BALL_MASS = 1.28, 42.8e-3, 0.44e-3
TRANSVERSE, POLAR = 1.38e-2, 1.24e-3
BALLS_AT, BEARINGS_AT = -20e-3, (110e-3, -150e-3)
"""Table 1, SI units."""
STIFFNESS, DAMPING_RATIO = (10750.0, 7900.0), 2.5e-4
"""Table 3: of a bearing along X and Y [N/m], and damping per stiffness [s]."""
DOUBLED = 2.0
"""By what the printed stiffness is multiplied, so that the printed critical speeds come out."""
WASHER = 12.4e-6
"""Unbalance of one [kg m]."""


class Unbalance(NamedTuple):
    """A row of table 2."""

    washers: int
    eccentricity: float
    """[m]."""
    misalignment: float
    """[rad]."""
    phase: float
    """[deg]; 0 where there is none."""


TABLE_2 = (
    Unbalance(0, 0.0, 6.1e-5, 0.0),
    Unbalance(1, 1.0e-5, 4.8e-5, 282.0),
    Unbalance(2, 1.9e-5, 5.1e-5, 247.0),
    Unbalance(3, 2.9e-5, 6.8e-5, 224.0),
    Unbalance(4, 3.9e-5, 9.2e-5, 211.0),
)
BALANCE_DAMPING = 0.1
"""c_b / (m R^2 Omega_cyl,X): of the three that the paper tries the one it finds best."""
CYLINDRICAL_X = 1675.0 * RPM
"""Omega_cyl,X, measured [rad/s]."""


def rig(
    unbalance: Unbalance,
    multiplied: float = DOUBLED,
    race_damping: float = BALANCE_DAMPING,
) -> RigidRotor:
    """The rig with one of the unbalances.

    Parameters
    ----------
    unbalance
        Of the disc.
    multiplied
        The printed stiffness by this; the damping goes with it.
    race_damping
        c_b / (m R^2 Omega_cyl,X).
    """
    kx, ky = (multiplied * k for k in STIFFNESS)
    c = DAMPING_RATIO * kx, DAMPING_RATIO * ky
    return RigidRotor(
        mass=MASS,
        transverse=TRANSVERSE,
        polar=POLAR,
        radius=RADIUS,
        bearings=tuple(Bearing(height, (kx, ky), c) for height in BEARINGS_AT),
        eccentricity=unbalance.eccentricity,
        misalignment=unbalance.misalignment,
        phase=math.radians(unbalance.phase),
        ball_mass=BALL_MASS,
        planes=(BALLS_AT, BALLS_AT),
        drag=race_damping * BALL_MASS * RADIUS**2 * CYLINDRICAL_X,
    )
