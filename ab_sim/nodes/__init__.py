"""The ROS 2 nodes: thin, no physics. Each runs in its own process."""
