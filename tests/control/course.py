"""Runs of the package's drive, commanded by a controller that receives a separate sensor model."""

import math
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from ab_sim import Drive, load_scene
from ab_sim.control import SensorFacts, StartUpSettings

Sample = tuple[float, ...]
"""Time, angle, speed and readings of a sample."""
Change = Callable[[Sample], Iterable[Sample]]
"""Function that alters a sample on its way to a controller, or drops it."""
FINAL = 200.0
NOISE = {"displacement": 1.3e-6, "acceleration": 0.053}
"""Noise: 1 % of the whirl without balls at the final speed [m], [m/s^2]."""


def settings(quantity: str = "displacement", axes: int = 1, **other: Any) -> StartUpSettings:
    """Return the settings of a controller for the drive of ``Course``."""
    known: Any = quantity
    sensing = SensorFacts(known, axes, 0.3, NOISE[quantity])
    return StartUpSettings(FINAL, 200.0, sensing, 0.005)._replace(**other)


def as_it_is(sample: Sample) -> Iterable[Sample]:
    """Pass the sample unchanged."""
    yield sample


class Course:
    """Drive of ``balanced-start-up``, with the samples that its controllers receive.

    Parameters
    ----------
    told
        Settings of the controllers.
    change
        Alteration of samples.
    changes
        Changes of the scene.
    """

    def __init__(self, told: StartUpSettings, change: Change = as_it_is, changes: Any = ()) -> None:
        limit = "spindle.max_acceleration=200"
        self.drive = Drive(load_scene("balanced-start-up", [limit, *changes]), commanded=True)
        self._told, self._change = told, change
        self._draw = np.random.default_rng(1)
        self.commands: list[float] = []

    def on(self, seconds: float, leader: Any, *others: Any) -> None:
        """Advance under the commands of one controller; call the others with the same samples."""
        sensing = self._told.sensing
        c, s = math.cos(sensing.axis_angle), math.sin(sensing.axis_angle)
        names = ("ax", "ay") if sensing.quantity == "acceleration" else ("x", "y")
        for _ in range(round(seconds / self._told.period)):
            now = self.drive.time
            self.commands.append(leader.command(now))
            for other in others:
                other.command(now)
            self.drive.command(self.commands[-1], 200.0)
            run = self.drive.advance(5)
            x, y = (run[name] for name in names)
            noise = self._draw.normal(0.0, NOISE[sensing.quantity], (2, len(x)))
            readings = c * x + s * y + noise[0], c * y - s * x + noise[1]
            columns = [run[name] for name in ("time", "angle", "speed")]
            for sound in zip(*(column.tolist() for column in (*columns, *readings)), strict=True):
                for sample in self._change(sound):
                    for each in (leader, *others):
                        each.sample(*sample)

    def free_whirl(self) -> float:
        """Return the whirl after 4 s at the last command, when a free whirl is gone [m]."""
        self.drive.advance(3995)
        run = self.drive.advance(5)
        return float(np.hypot(run["x"], run["y"]).mean())
