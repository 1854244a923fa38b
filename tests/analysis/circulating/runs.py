"""Long runs that start in a circulating state, or close to it."""

from typing import Any

import numpy as np

from ab_sim.analysis.circulating import CirculatingBunch, state_of_bunch
from ab_sim.analysis.equilibria.resting import resting_system
from ab_sim.drive import Drive
from ab_sim.scene import Scene
from ab_sim.scene.load import changed_scene
from tests.analysis.equilibria.drives import drive

STALLING: dict[str, Any] = {
    "M": 0.524, "me": 1e-4, "k": 58800.0, "c": 20.0, "R": 0.015, "m": (4e-3,) * 6, "cb": 0.05,
}  # fmt: skip
"""Six balls of 4 g; critical speed 335 rad/s."""
AT = 1152.0
"""Spindle speed [rad/s] at which the balls circulate at 307 rad/s."""


def stalling(**changes: Any) -> Scene:
    """Return the scene of ``STALLING`` with changes."""
    return drive(**{"rolls": False, **STALLING, **changes})


def mean_speeds(
    scene: Scene,
    speed: float,
    begin: CirculatingBunch | np.ndarray,
    duration: float = 10.0,
    off: float = 1e-3,
) -> np.ndarray:
    """Return the balls' mean absolute speeds over the last half of a run at constant speed [rad/s].

    Parameters
    ----------
    scene
        Scene to run.
    speed
        Spindle speed w [rad/s].
    begin
        Start of the run, a bunch or a state.
    duration
        Duration of the run [s].
    off
        Standard deviation of a random displacement of each ball [rad], so that a bunch can fall
        apart.
    """
    step = round(0.25 / abs(speed), 6)
    held = {"start.speed": speed, "spindle.max_speed": 2.0 * abs(speed), "solver.step": step}
    run = Drive(changed_scene(scene, held, "held"))
    system = resting_system(scene)
    own = begin if isinstance(begin, np.ndarray) else state_of_bunch(system, begin)
    state, n = own.copy(), len(system.balls)
    state[4 : 4 + n] += off * np.random.default_rng(0).normal(size=n)
    run.restore(run.snapshot()._replace(state=state))
    done = run.advance(round(duration / step), every=10)
    half, time = len(done) // 2, done["time"]
    # By a straight line: the ends' swings would count in a difference.
    found: np.ndarray = speed + np.polyfit(time[half:] - time[half], done.ball_angles[half:], 1)[0]
    return found
