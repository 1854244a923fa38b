"""ab_sim: an optical disc drive whose spindle carries a ball-type automatic balancer.

The rooms, left to right: ``scene`` (what to simulate), ``dynamics`` (equations and effects),
``integrate`` (steppers), ``spindle`` (speed profiles and the servo), ``drive`` (one running
drive), and then either ``nodes`` (live, ROS 2) or ``analysis`` and ``cli`` (offline).
"""

__version__ = "0.1.0"

# The effects register themselves with the scene room when they are imported, so that a scene
# can be checked against them without that room knowing who provides them.
from ab_sim.dynamics import effects as _effects  # noqa: F401
