"""Timing of a drive as another process receives it; for realtime.py."""

import time
from typing import Any, NamedTuple

import numpy as np
import rclpy

from ab_msgs_py import Block, Health, Qos, topics
from ab_msgs_py.samples import nanoseconds_of
from ab_msgs_py.topic import arrived

DEEP = Qos(20_000)
LOOK = 0.005
"""Time between two checks for new messages [s]."""
QUANTILES = 1.0 - np.logspace(0.0, -6.0, 61)


class Ear:
    """Subscriber to a drive: clock, blocks and commands, and the nodes' health reports.

    The middleware's thread stamps messages on reception, so it does not matter when this process
    reads them. Times are on the steady clock, which the drive uses as well.
    """

    def __init__(self) -> None:
        self._node = rclpy.create_node("ear")
        self._clock, self._blocks, self._commands, self._health = (
            topic._replace(qos=DEEP).subscription(self._node, print)
            for topic in (topics.CLOCK, topics.BLOCK, topics.COMMAND, topics.DIAGNOSTICS)
        )
        self.values: dict[str, dict[str, str]] = {}
        self.forget()

    def forget(self) -> None:
        """Discard everything except health reports."""
        self.clock: list[tuple[float, int]] = []
        """Time of reception [s] and clock [ns] of each message."""
        self.blocks: list[np.ndarray] = []
        """Steps and commands in force, shape (samples, 2)."""
        self.commands: list[tuple[float, float]] = []
        """Time of reception [s] and speed [rad/s] of each command."""

    def listen(self, seconds: float) -> None:
        """Receive messages for a time [s]."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._look()
            time.sleep(LOOK)

    def until(self, condition: Any, what: str) -> None:
        """Receive messages until a condition is true."""
        end = time.monotonic() + 300.0
        while not condition():
            if time.monotonic() > end:
                raise SystemExit(f"not within 300 s: {what}")
            self.listen(0.1)

    def _look(self) -> None:
        ahead = time.monotonic_ns() - time.time_ns()
        for message, received in arrived(self._clock, 10_000):
            self.clock.append((1e-9 * (received + ahead), nanoseconds_of(message.clock)))
        for message, received in arrived(self._commands, 10_000):
            self.commands.append((1e-9 * (received + ahead), topics.COMMAND.sample(message)))
        for message, _ in arrived(self._blocks, 10_000):
            block = Block.of(message)
            self.blocks.append(block.samples[:, [0, block.channels.index("command")]])
        for message, _ in arrived(self._health, 100):
            for health in Health.all_of(message):
                self.values[health.node.lstrip("/")] = health.values


class Pace(NamedTuple):
    """Timing of a drive with one step per wake-up, at the speed of the real clock."""

    at: np.ndarray
    """Time at which the last message of each wake-up was received [s]."""
    lateness: np.ndarray
    """Delay of each message after its due time [s]; the fastest of each second counts as 0."""
    factor: float
    """Ratio of simulated to real time."""
    lost: float
    """Time by which the simulation has fallen behind [s]."""
    wrong: int
    """Number of stamps that are no whole steps or do not increase."""

    @classmethod
    def of(cls, clock: list[tuple[float, int]], step: float) -> "Pace":
        """Compute the timing from the clock's messages and their times of reception."""
        heard, stamps = np.array([at for at, _ in clock]), np.array([ns for _, ns in clock])
        lag = heard - 1e-9 * stamps
        passed = heard - heard[0]
        # The last second is a whole one and the rest.
        whole = np.minimum(np.floor(passed), max(np.floor(passed[-1]) - 1.0, 0.0))
        _, begins, second = np.unique(whole, return_index=True, return_inverse=True)
        least = np.minimum.reduceat(lag, begins)
        # A late wake-up takes all steps that are due; the first of them was due the longest ago.
        due = 1e-9 * stamps[:-1] + step + least[second[1:]]
        wrong = np.sum(stamps % round(1e9 * step) != 0) + np.sum(np.diff(stamps) <= 0)
        return cls(
            heard[1:],
            np.maximum(heard[1:] - due, 0.0),
            # From a quickest message to another: how late the last one was does not count.
            1.0 - float(least[-1] - least[0]) / max(float(passed[-1]) - 1.0, 1.0),
            float(least[-1] - least[0]),
            int(wrong),
        )


def spread(lateness: np.ndarray) -> dict[str, Any]:
    """Return percentiles [ms], and a distribution for the picture."""
    if not len(lateness):
        return {}
    shares = {"p50": 0.5, "p99": 0.99, "p99.9": 0.999, "worst": 1.0}
    figures = {
        f"{name} [ms]": round(1e3 * float(np.quantile(lateness, share)), 4)
        for name, share in shares.items()
    }
    curve = [round(1e3 * float(q), 5) for q in np.quantile(lateness, QUANTILES)]
    return {**figures, "count": len(lateness), "at QUANTILES [ms]": curve}


def delays(ear: Ear, step: float) -> np.ndarray:
    """Return the delays from a command's arrival to that of the first output with it [s]."""
    samples = np.concatenate(ear.blocks)
    begins = 1 + np.flatnonzero(np.diff(samples[:, 1]))
    first = {speed: int(at) for at, speed in reversed(samples[begins].tolist())}
    heard, stamps = np.array([at for at, _ in ear.clock]), np.array([ns for _, ns in ear.clock])
    found = []
    for came, speed in ear.commands:
        if speed in first:
            shown = np.searchsorted(stamps, round(1e9 * first.pop(speed) * step))
            if 0 < shown < len(heard):
                found.append(heard[shown] - came)
    return np.array(found)


def missing(ear: Ear) -> int:
    """Return the number of samples missing between the first and the last block."""
    return int(np.sum(np.diff(np.concatenate(ear.blocks)[:, 0]) - 1))


def recovered(pace: Pace, ended: float, period: float, usual: float) -> float | None:
    """Return the time after the end of a load until a second is as good as before [s].

    Parameters
    ----------
    pace
        Timing after the load.
    ended
        End of the load [s].
    period
        Period of wake-ups [s]; a wake-up that is late by more is an overrun.
    usual
        Share of overruns before the load; one in a hundred more is accepted.
    """
    for begin in np.arange(ended, pace.at[-1] - 1.0, 0.05):
        inside = pace.lateness[(pace.at >= begin) & (pace.at < begin + 1.0)]
        if len(inside) and np.mean(inside >= period) <= usual + 0.01:
            return round(float(begin - ended), 2)
    return None
