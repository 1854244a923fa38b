"""The ROS 2 nodes: thin, without physics. Each runs in a separate process."""

import sys

from ab_sim import interruption

if sys.argv[0] == "-m":
    # `python -m` is about to start a node, whose imports take seconds.
    interruption.watch()
    interruption.heed()
