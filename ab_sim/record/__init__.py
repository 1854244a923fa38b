"""Recordings of runs: Rerun files and ROS bags."""
