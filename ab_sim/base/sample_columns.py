"""Columns with which every sample of a run begins."""

SPINDLE_CHANNELS = ("step", "time", "angle", "speed", "command")
"""Names of the columns: steps taken; time [s]; angle and speed of the spindle [rad, rad/s];
requested speed [rad/s]."""
STEP, TIME, ANGLE, SPEED, COMMAND, DECK = range(6)
"""Positions of the columns in ``samples``, and of the deck's first channel after them."""
