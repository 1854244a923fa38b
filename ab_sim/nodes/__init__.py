"""The ROS 2 nodes: thin, no physics. Each runs in its own process."""

import sys

from ab_sim import interruption

if sys.argv[0] == "-m":
    # `python -m` is on its way to a node, whose own imports take seconds.
    interruption.watch()
    interruption.heed()
