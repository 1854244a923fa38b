"""What a stepper is told, before it starts, of the motion that it solves exactly.

In a file of its own: kernels are made of what their imports lead to, and not of all carriers.
"""

import numpy as np

from ab_sim.dynamics.assemble import own_motion
from ab_sim.dynamics.system import System
from ab_sim.integrate.stepper import Stepper


def put_own_motion(system: System, stepper: Stepper, tables: np.ndarray) -> None:
    """Have a workspace's tables say what of a system's motion is linear, if a stepper wants that.

    Args:
        system: what moves.
        stepper: says where.
        tables: ``Workspace.tables``.
    """
    if stepper.own_motion_at is not None:
        own = own_motion(system)
        tables[stepper.own_motion_at : stepper.own_motion_at + len(own)] = own
