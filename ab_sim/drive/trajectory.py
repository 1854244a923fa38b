"""Samples of a run: one row per integration step, one named channel per column.

The orientation of a deck in space is a quaternion (w, x, y, z) from deck axes to inertial axes. Any
length is allowed. The last axis of an array of quaternions has the four numbers.
"""

import operator
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from ab_sim.base.errors import nearest, short
from ab_sim.base.ordered_sum import ordered_dot
from ab_sim.base.presentation import Column, Columns, Presented, ends, number
from ab_sim.base.sample_columns import SPINDLE_CHANNELS, STEP

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


NONE = (1.0, 0.0, 0.0, 0.0)
"""Quaternion (w, x, y, z) of no rotation."""


def matrix_of(turn: np.ndarray) -> np.ndarray:
    """Return the rotation matrices of quaternions, shape (..., 3, 3)."""
    unit = turn / np.sqrt(np.sum(turn * turn, axis=-1, keepdims=True))
    w, x, y, z = unit[..., 0], unit[..., 1], unit[..., 2], unit[..., 3]
    xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, x * y, x * z, y * z
    wx, wy, wz = w * x, w * y, w * z
    rows = (
        *(0.5 - yy - zz, xy - wz, xz + wy),
        *(xy + wz, 0.5 - xx - zz, yz - wx),
        *(xz - wy, yz + wx, 0.5 - xx - yy),
    )
    return 2.0 * np.stack(rows, axis=-1).reshape(*turn.shape[:-1], 3, 3)


def tilt_of(turn: np.ndarray) -> np.ndarray:
    """Return the angles alpha, beta, gamma [rad] of quaternions, shape (..., 3).

    Beta and gamma are within +-pi, alpha within +-pi/2.

    The deck is turned by gamma about Z, then by alpha about the new x, then by beta about the last
    y. This is the order of Kim and Chung, Rz(gamma) Rx(alpha) Ry(beta), with their matrix elements.
    """
    turned = matrix_of(turn)
    alpha = np.arcsin(np.clip(turned[..., 2, 1], -1.0, 1.0))
    beta = np.arctan2(-turned[..., 2, 0], turned[..., 2, 2])
    gamma = np.arctan2(-turned[..., 0, 1], turned[..., 1, 1])
    return np.stack([alpha, beta, gamma], axis=-1)


MAX_VALUES = 250_000_000
"""Largest number of values (2 GB); longer runs are refused before they start."""


def channels_for(
    deck_model: Sequence[str], balls: int, motor: bool = False, readings: Iterable[str] = ()
) -> tuple[str, ...]:
    """Return the names of the columns: spindle, deck model, balls, motor, sensor readings."""
    ball_channels = (f"ball_{i}_{what}" for i in range(balls) for what in ("angle", "rate"))
    torque = ("motor_torque",) if motor else ()
    return (*SPINDLE_CHANNELS, *deck_model, *ball_channels, *torque, *readings)


def taken(run: "Trajectory", every: int) -> np.ndarray:
    """Return the rows of a non-empty run at the steps that are multiples of ``every``."""
    return run.samples[-int(run.samples[0, STEP]) % every :: every]


def check_room(steps: int, every: int, channels: Sequence[str]) -> tuple[int, int]:
    """Check that the samples of a run fit in memory, and return ``steps`` and ``every``.

    Parameters
    ----------
    steps
        Number of steps.
    every
        Number of steps per sample to keep.
    channels
        Channels of a sample.

    Raises
    ------
    TypeError
        ``steps`` or ``every`` is not an integer.
    ValueError
        A number is too small, or too many samples result; the message names the limit and an
        ``every`` that suffices.
    """
    steps, every = _counted("steps", steps, least=0), _counted("every", every, least=1)
    fit = MAX_VALUES // len(channels)
    if steps // every > fit:
        enough = steps // (fit + 1) + 1
        raise ValueError(
            f"steps = {short(steps)}: with every = {short(every)} there would be "
            f"{short(steps // every)} samples, at most {fit} are allowed; keep fewer with every = "
            f"{short(enough)} or more, or advance in parts"
        )
    return steps, every


def _counted(name: str, value: int, least: int) -> int:
    """Return a value as an int; refuse one that is not a whole number of at least ``least``."""
    try:
        # operator.index would accept a bool as 0 or 1.
        whole = None if isinstance(value, bool) else operator.index(value)
    except TypeError:
        whole = None
    if whole is None:
        raise TypeError(f"{name} = {short(value)}: must be a whole number, at least {least}")
    if whole < least:
        raise ValueError(f"{name} = {short(whole)}: must be at least {least}")
    return whole


def column_of(channel: str, channels: Sequence[str]) -> int:
    """Return the column of a channel.

    Raises
    ------
    KeyError
        No channel has that name; the message lists the nearest and all names.
    """
    try:
        return channels.index(channel)
    except ValueError:
        raise KeyError(
            f"no channel {channel!r}{nearest(str(channel), channels)}; there are: "
            + ", ".join(channels)
        ) from None


def whirl_of(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return W = |u| [m] of displacements that are far from overflow and underflow."""
    # The C library's hypot, which handles overflow and underflow, takes four times as long.
    whirl = np.multiply(x, x, dtype=float)
    whirl += y * y
    return np.sqrt(whirl, out=whirl)


def is_ball_angle(channel: str) -> bool:
    """Return whether a channel is the angle of a ball."""
    return channel.startswith("ball_") and channel.endswith("_angle")


@lru_cache
def balls_in(channels: tuple[str, ...]) -> int:
    """Return the number of balls whose angles are among the channels."""
    # Cached: a drive calls this at every observation.
    return sum(map(is_ball_angle, channels))


@dataclass(frozen=True, repr=False, init=False)
class Trajectory(Presented):
    """Consecutive samples of a run, one row per integration step, in SI units.

    ``step`` counts integration steps; ``time`` [s]; ``angle`` and ``speed`` of the spindle [rad,
    rad/s]; ``command`` [rad/s], the commanded speed; ``x``, ``y``, ``vx``, ``vy``, ``ax``, ``ay``
    of the deck on inertial axes [m, m/s, m/s^2]; per ball its ``angle`` from the unbalance,
    unwrapped [rad], and its ``rate`` relative to the race [rad/s]; with a motor its
    ``motor_torque`` [N m]; of each sensor its readings ``NAME_1`` and ``NAME_2`` [m/s^2].

    A deck in space has ``z``, ``vz``, ``az`` as well, all of C; the quaternion ``qw``, ``qx``,
    ``qy``, ``qz`` from deck axes to inertial axes; the angular velocity ``wx``, ``wy``, ``wz``
    [rad/s] and its rates ``wx_rate`` ... [rad/s^2] on deck axes. Its sensors have a third axis,
    ``NAME_3``.

    Examples
    --------
    >>> import ab_sim
    >>> run = ab_sim.Drive(ab_sim.load_scene("thesis-hold")).advance(100)
    >>> run
    <Trajectory: samples 100, time 0.001 to 0.1 s, balls 2, W at the end 2.129e-06 m>
    >>> run["speed"].shape, run.whirl.shape, run.ball_angles.shape
    ((100,), (100,), (100, 2))
    >>> run.plot().savefig("run.png")  # doctest: +SKIP
    >>> run.to_dataframe()["x"]  # doctest: +SKIP
    """

    _picture = "trajectory"
    _rows = 0

    channels: tuple[str, ...]
    samples: np.ndarray
    """Samples in SI units, shape (samples, channels)."""

    def __init__(self, channels: tuple[str, ...], samples: np.ndarray) -> None:
        # The generated __init__ of a frozen dataclass takes twice as long.
        self.__dict__.update(channels=channels, samples=samples)

    @classmethod
    def join(cls, parts: Sequence["Trajectory"]) -> "Trajectory":
        """Concatenate trajectories."""
        return cls(parts[0].channels, np.concatenate([part.samples for part in parts]))

    def decimated(self, every: int, after: int = 0) -> "Trajectory":
        """Return every ``every``-th sample, the last of each group, as a copy if ``every`` > 1.

        Parameters
        ----------
        every : int
            Size of a group.
        after : int, default 0
            Number of samples before this trajectory, from which groups are counted.
        """
        if every == 1:
            return self
        return Trajectory(self.channels, self.samples[(-1 - after) % every :: every].copy())

    def last(self, count: int) -> "Trajectory":
        """Return the last ``count`` samples, or all if there are fewer; none if ``count`` < 1."""
        return Trajectory(self.channels, self.samples[max(len(self) - max(count, 0), 0) :])

    def __len__(self) -> int:
        return len(self.samples)

    def __getitem__(self, channel: str) -> np.ndarray:
        """Return one channel, shape (samples,).

        Raises
        ------
        KeyError
            No channel has that name; the message lists the nearest and all names.
        """
        return self.samples[:, column_of(channel, self.channels)]

    @property
    def balls(self) -> int:
        """Return the number of balls."""
        return balls_in(self.channels)

    @property
    def position(self) -> np.ndarray:
        """Return the deck's displacement on inertial axes [m], shape (samples, 2 or 3)."""
        return self._from("x", self._ways)

    @property
    def velocity(self) -> np.ndarray:
        """Return the deck's velocity on inertial axes [m/s], shape as ``position``."""
        return self._from("vx", self._ways)

    @property
    def acceleration(self) -> np.ndarray:
        """Return the deck's acceleration on inertial axes [m/s^2], shape as ``position``."""
        return self._from("ax", self._ways)

    @property
    def whirl(self) -> np.ndarray:
        """Return W = |u| [m], shape (samples,); in space, that of C across Z."""
        return whirl_of(self["x"], self["y"])

    @property
    def tilts(self) -> bool:
        """Return whether the deck moves in space."""
        return "qw" in self.channels

    @property
    def turn(self) -> np.ndarray:
        """Return quaternions (w, x, y, z) from deck axes to inertial axes, shape (samples, 4)."""
        if not self.tilts:
            return np.broadcast_to(NONE, (len(self), 4))
        return self._from("qw", 4)

    @cached_property
    def turned(self) -> np.ndarray:
        """Return rotation matrices from deck axes to inertial axes, shape (samples, 3, 3)."""
        return matrix_of(self.turn)

    @property
    def tilt(self) -> np.ndarray:
        """Return the deck's angles alpha, beta, gamma, unwrapped [rad], shape (samples, 3)."""
        return np.unwrap(tilt_of(self.turn), axis=0)

    @property
    def angular_velocity(self) -> np.ndarray:
        """Return the deck's angular velocity on inertial axes [rad/s], shape (samples, 3)."""
        return self._turning("wx")

    @property
    def angular_acceleration(self) -> np.ndarray:
        """Return the deck's angular acceleration on inertial axes [rad/s^2], shape (samples, 3)."""
        # The rotation of the axes adds no term: it is the cross product of the velocity with
        # itself.
        return self._turning("wx_rate")

    @property
    def ball_angles(self) -> np.ndarray:
        """Return the unwrapped ball angles theta_i [rad], shape (samples, balls)."""
        return self._of_balls("angle")

    @property
    def ball_rates(self) -> np.ndarray:
        """Return the ball rates theta_i' [rad/s], shape (samples, balls)."""
        return self._of_balls("rate")

    def _facts(self) -> dict[str, str]:
        facts = {"samples": str(len(self))}
        if len(self):
            names = {"time", "x", "y"} & {*self.channels}
            if "time" in names:
                facts["time"] = ends(self["time"][0], self["time"][-1], "s")
            facts["balls"] = str(self.balls)
            if len(names) == 3:
                whirl = float(np.hypot(self["x"][-1], self["y"][-1]))
                facts["W at the end"] = number(whirl, "m")
        return facts

    def _columns(self) -> Columns:
        return {name: Column(unit_of(name), self[name]) for name in self.channels}

    @property
    def _ways(self) -> int:
        """Return the number of axes along which the deck moves."""
        return 3 if self.tilts else 2

    def _from(self, first: str, count: int) -> np.ndarray:
        """Return ``count`` adjacent channels from the channel ``first`` on, as a view."""
        at = column_of(first, self.channels)
        return self.samples[:, at : at + count]

    def _turning(self, first: str) -> np.ndarray:
        """Return a vector in three channels on deck axes, turned to inertial axes."""
        if not self.tilts:
            return np.zeros((len(self), 3))
        return ordered_dot(self.turned, self._from(first, 3)[:, None])

    def _of_balls(self, what: str) -> np.ndarray:
        """Return the channel ``angle`` or ``rate`` of all balls, shape (samples, balls)."""
        if not self.balls:
            return np.empty((len(self), 0))
        first = column_of(f"ball_0_{what}", self.channels)
        return self.samples[:, first : first + 2 * self.balls : 2]
