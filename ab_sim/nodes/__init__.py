"""The ROS 2 nodes: thin, without physics. Each runs in a separate process."""

import importlib.util
import sys

from ab_sim.base import interruption

_NEEDS_ROS = (
    "ROS 2 is needed to run a node, and there is no rclpy; install it with "
    "`pip install 'ab_sim[ros]'`, or source your ROS 2 installation"
)

if sys.argv[0] == "-m":
    # `python -m` starts a node. Its imports take seconds, in which a signal would be lost.
    interruption.watch()
    interruption.accept_signals()
    if importlib.util.find_spec("rclpy") is None:
        sys.exit(_NEEDS_ROS)
