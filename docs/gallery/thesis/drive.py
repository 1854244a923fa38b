"""The thesis' drive as a scene, its start-ups, and what its text states of them."""

import functools
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ab_sim import Scene, Trajectory, load_scene, metrics_of, simulate_batch
from ab_sim.analysis.metrics import rms
from ab_sim.analysis.startup import peak_whirl
from ab_sim.drive.closed_forms import driving_forces, resultant
from ab_sim.scene.load import changed_scene

Tell = Callable[[str, int, int], None]
Told = Callable[[int, int], None]
"""Told how many runs are done, of how many."""

ACCELERATION = 40.0
"""[rad/s^2]: twice the printed "half of the initial acceleration", 20 rad/s^2."""
BASE = "thesis-baseline"
"""The scene that has its parameters."""
OPPOSITE = 25.0
"""[deg] from -180: "in the vicinity". The thesis calls -200 so, and not -150, where 4.1 and 5.1
end: half-way between the two."""
AFTER = 2.5
"""[s] after the critical speed the figures end; with a variable-speed period, too."""


class Period(NamedTuple):
    """A variable-speed period."""

    start: float = 2.5
    """[s], from standstill."""
    duration: float = 0.5
    """[s]."""
    acceleration: float = 0.0
    """[rad/s^2]."""


HOLD = Period()
"""The thesis' first: from the critical speed on, 0.5 s at constant speed (figure 4.7)."""


class Parameters(NamedTuple):
    """What the thesis varies; as at the head of its chapter 4."""

    M: float = 0.1
    """Of deck, rotor and balls [kg]."""
    k: float = 1000.0
    """[N/m]."""
    c: float = 0.2
    """[N s/m]."""
    e: float = 1e-4
    """[m]."""
    R: float = 0.01
    """[m]."""
    a: float = 1e-3
    """[m]."""
    m: float = 1e-3
    """Of a ball [kg]."""
    beta_b: float = 1e-6
    """Arm of rolling friction [m]."""
    c_b: float = 1.0
    """[N s/m]."""
    starts: tuple[float, ...] = (0.0, 0.0)
    """Of the balls, from the unbalance [deg]."""

    @property
    def critical_speed(self) -> float:
        """sqrt(k/M) (4-1) [rad/s]."""
        return math.sqrt(self.k / self.M)

    @property
    def carried(self) -> float:
        """2 m R over M0 e: what both balls carry at one place, over the disc's unbalance."""
        return 2.0 * self.m * self.R / ((self.M - 2.0 * self.m) * self.e)

    @property
    def critical_time(self) -> float:
        """When a start-up without a period reaches the critical speed [s]."""
        return self.critical_speed / ACCELERATION


THESIS = Parameters()


class StartUp(NamedTuple):
    """A start-up that has been run, until 2.5 s after the critical speed."""

    parameters: Parameters
    period: Period | None
    scene: Scene
    trajectory: Trajectory

    @property
    def whirl(self) -> np.ndarray:
        """W/e."""
        return np.asarray(self.trajectory.whirl / self.parameters.e)

    @property
    def peak(self) -> tuple[float, float]:
        """Largest W/e, and when [s]."""
        whirl, time = peak_whirl(self.trajectory)
        return whirl / self.parameters.e, time

    @property
    def forces(self) -> np.ndarray:
        """Driving force on the balls (2-15), signed [N], shape (samples, balls)."""
        return driving_forces(self.trajectory, self.scene)

    @property
    def forward(self) -> np.ndarray:
        """Larger one of the driving forces [N] until it reverses, above the critical speed."""
        return _until_reversed(self.forces.max(axis=1))

    @property
    def forward_peak(self) -> tuple[float, float]:
        """Largest of these [N], and when [s]: what the thesis reads off its figures."""
        top = int(np.argmax(self.forward))
        return float(self.forward[top]), float(self.trajectory["time"][top])

    @property
    def forward_each(self) -> np.ndarray:
        """The largest force on each ball until that one reverses [N]."""
        return np.array([_until_reversed(force).max() for force in self.forces.T])

    @property
    def angles(self) -> np.ndarray:
        """The balls' at the end, from the unbalance, unwrapped [deg]."""
        return np.degrees(self.trajectory.ball_angles[-1])

    @property
    def settling(self) -> float | None:
        """From the period's start until all balls first are at -180 deg or beyond [s].

        The thesis' settling period; without a period from the critical speed on.
        """
        return metrics_of(self.trajectory, self.scene, ["settling_period"]).settling_period

    @property
    def residual(self) -> float:
        """Unbalance that is left at the end, over that of the disc."""
        p = self.parameters
        shares = np.array(self.scene.balls.masses) * p.R
        shares = shares / (self.scene.eccentric_mass * p.e)
        return float(np.abs(1.0 + resultant(shares, self.trajectory.ball_angles[-1:]))[0])

    @property
    def final_whirl(self) -> float:
        """Root mean square of W/e over the last tenth of a second."""
        time = self.trajectory["time"]
        return rms(self.whirl[time > time[-1] - 0.1])


def _until_reversed(force: np.ndarray) -> np.ndarray:
    """A force's course until it reverses, above the critical speed."""
    rises = int(np.argmax(force > 0.5 * force.max()))
    reverses = np.flatnonzero(force[rises:] < 0.0)
    return np.asarray(force[: rises + int(reverses[0])] if len(reverses) else force)


def start_ups(
    cases: Sequence[tuple[Parameters, Period | None]],
    tell: Told | None = None,
    every: int = 1,
    target: float = 400.0,
    duration: float | None = None,
) -> list[StartUp]:
    """Run start-ups.

    Parameters
    ----------
    cases
        Their parameters and variable-speed periods.
    tell
        Called with (runs done, runs).
    every
        Keep each so-many-th step of 1 ms.
    target
        Speed [rad/s] at which they end; 400 is not reached, as in the figures.
    duration
        Of each [s]; None: until 2.5 s after the critical speed.
    """
    variations = [variation_of(*case, target, duration) for case in cases]
    base = _base()
    scenes = [changed_scene(base, variation, "the thesis") for variation in variations]
    runs = simulate_batch(base, variations, every=every, progress=tell).runs
    return [
        StartUp(*case, scene, run.trajectory)
        for case, scene, run in zip(cases, scenes, runs, strict=True)
    ]


@functools.cache
def _base() -> Scene:
    return load_scene(BASE)


def variation_of(
    p: Parameters, period: Period | None, target: float, duration: float | None
) -> dict[str, Any]:
    """A start-up as changes of the scene ``BASE``; arguments as of ``start_ups``."""
    changes = {
        "rotor.total_mass": p.M,
        "rotor.eccentricity": p.e,
        "race.radius": p.R,
        "balls.mass": p.m,
        "balls.radius": p.a,
        "effects.suspension.stiffness": p.k,
        "effects.suspension.damping": p.c,
        "effects.viscous_drag.coefficient": p.c_b,
        "effects.rolling_friction.arm": p.beta_b,
        "start.ball_angles": np.radians(p.starts).tolist(),
        "profile.target_speed": target,
        # To 10 ms: runs of which every tenth step is kept end at the same instant as others.
        "duration": round(p.critical_time + AFTER, 2) if duration is None else duration,
    }
    if period is not None:
        changes["profile.variable_speed_period"] = {
            "start_speed": ACCELERATION * period.start,
            "duration": period.duration,
            "acceleration": period.acceleration,
        }
    return changes
