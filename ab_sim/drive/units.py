"""Units of the channels of samples."""

import re

_UNITS = {
    "step": "1",
    "time": "s",
    "angle": "rad",
    "speed": "rad/s",
    "command": "rad/s",
    "motor_torque": "N m",
    "whirl": "m",
    "once_per_turn": "m",
    "phase": "rad",
}
_KINDS = (
    (re.compile(r"[xyz]"), "m"),
    (re.compile(r"v[xyz]"), "m/s"),
    (re.compile(r"a[xyz]"), "m/s^2"),
    (re.compile(r"q[wxyz]"), "1"),
    (re.compile(r"w[xyz]"), "rad/s"),
    (re.compile(r"w[xyz]_rate"), "rad/s^2"),
    (re.compile(r"ball_\d+_angle"), "rad"),
    (re.compile(r"ball_\d+_rate"), "rad/s"),
    (re.compile(r"[a-z][a-z0-9_]*_[123]"), "m/s^2"),  # a sensor's reading
)


def unit_of(channel: str) -> str | None:
    """Return the unit of a channel of ``Trajectory`` or of a derived channel.

    None for other names.
    """
    if channel in _UNITS:
        return _UNITS[channel]
    return next((unit for kind, unit in _KINDS if kind.fullmatch(channel)), None)
