"""ab_sim: an optical disc drive whose spindle carries a ball-type automatic balancer.

The rooms, left to right: ``scene`` (what to simulate), ``spindle`` (speed profiles and the
servo), ``dynamics`` (equations and effects), ``integrate`` (steppers), ``sensing``
(accelerometers), ``drive`` (one running drive), ``accuracy`` (what one costs, and what a live
drive has), ``batch`` (many runs), ``analysis`` (what a run is judged by), ``studies`` (what
effects and accuracy cost), ``recording``, ``figures``, ``papers`` (published ones computed
again), and at the end ``nodes`` (live, ROS 2) and ``cli``. A room imports from those before it
only; ``tests/test_rooms.py`` holds it to that.
"""

__version__ = "0.1.0"
