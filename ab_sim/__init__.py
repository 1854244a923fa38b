"""ab_sim: an optical disc drive whose spindle carries a ball-type automatic balancer.

The rooms, left to right: ``scene`` (what to simulate), ``dynamics`` (equations and effects),
``integrate`` (steppers), ``spindle`` (speed profiles and the servo), ``drive`` (one running
drive), and then either ``nodes`` (live, ROS 2) or ``analysis`` and ``cli`` (offline).
"""

__version__ = "0.1.0"
