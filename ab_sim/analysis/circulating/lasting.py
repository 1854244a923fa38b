"""Test whether a circulating bunch persists, by a simulation that starts near it."""

import math

import numpy as np

from ab_sim.analysis.circulating.bunch import CirculatingBunch
from ab_sim.analysis.equilibria.balanced import symmetric
from ab_sim.analysis.equilibria.resting import base_rotor_of, resting_system, running_at
from ab_sim.base.errors import DivergedError
from ab_sim.drive import Drive
from ab_sim.model.dynamics.system import StateLayout, System, layout_of
from ab_sim.scene.model import Scene


def state_of_bunch(system: System, bunch: CirculatingBunch) -> np.ndarray:
    """Return the bunch's state at an instant when the displacement points along the unbalance.

    The bunch's balls come first. The other balls rest at their balanced position, or opposite the
    unbalance if they cannot balance it.

    Parameters
    ----------
    system
        Planar system of the bunch's scene.
    bunch
        Circulating bunch.

    Returns
    -------
    np.ndarray
        State with shape (4 + 2 n,): u and v on the rotor's axes [m, m/s], angles [rad] and rates
        [rad/s].
    """
    layout: StateLayout = layout_of(system)
    p, backwards = bunch.count, bunch.spindle_speed < 0.0
    state = np.zeros(layout.size)
    # Displacement along the rotor's x axis; the deck's whirl at s gives its velocity.
    state[layout.deck] = bunch.W, 0.0, 0.0, bunch.speed * bunch.W
    angles = state[layout.angles]
    angles[:p] = -bunch.angle if backwards else bunch.angle
    angles[p:] = math.pi
    rotor = base_rotor_of(system)
    rest = symmetric(rotor._replace(moments=rotor.moments[p:], kinds=rotor.kinds[p:]))
    if rest is not None:
        angles[p:] = rest
    state[layout.rates][:p] = bunch.speed - bunch.spindle_speed
    return state


_BEATS = 1000.0
"""Duration of the simulation in beats, unless that takes more than ``_MOST_STEPS``."""
STEP = 0.25
"""Largest angle by which the spindle turns in a step [rad]."""
_FEWEST_BEATS = 50.0
"""Least number of beats of a meaningful simulation."""
_MOST_STEPS = 3e5
"""Largest number of steps of the simulation."""
OFF = 1e-3
"""Standard deviation of the disturbance of the ball angles [rad].

Without it, an unstable bunch would stay together: equal balls at one place never part.
"""
NEAR = 0.05
"""Largest relative change of the bunch's speed at which the bunch counts as lasting."""


def lasting_speed(scene: Scene, bunch: CirculatingBunch) -> float | None:
    """Return the mean speed of a bunch [rad/s] in the last half of a run; None if it does not last.

    A bunch lasts if its balls keep its speed and the others keep the spindle's. Friction is left
    out, as for resting states. None is also returned if the balls are nearly as fast as the rotor:
    a simulation of ``_FEWEST_BEATS`` beats would then take more than ``_MOST_STEPS`` steps.

    Parameters
    ----------
    scene
        Scene of the bunch.
    bunch
        Bunch near which the simulation starts.
    """
    w, n = bunch.spindle_speed, len(resting_system(scene).balls)
    step = min(scene.solver.step, max(round(STEP / abs(w), 9), 1e-9))
    beat = 2.0 * math.pi / abs(w - bunch.speed)
    steps = math.ceil(min(_BEATS * beat / step, _MOST_STEPS))
    if steps * step < _FEWEST_BEATS * beat:
        return None
    solver = scene.solver.model_copy(update={"stepper": "auto", "parameters": {}, "step": step})
    drive = Drive(running_at(scene, w).model_copy(update={"solver": solver}))
    state = state_of_bunch(resting_system(scene), bunch)
    state[4 : 4 + n] += OFF * np.random.default_rng(0).normal(size=n)
    drive.restore(drive.snapshot()._replace(state=state, memory=np.empty(0)))
    try:
        run = drive.advance(steps, every=max(1, steps // 20_000))
    except DivergedError:
        return None
    # Judge the last half only: the closed form is not exact, so that the bunch first drifts.
    half = len(run) // 2
    time = run["time"][half:] - run["time"][half]
    # Fit a straight line: a difference of the end points would contain the swings.
    speeds = w + np.polyfit(time, run.ball_angles[half:], 1)[0]
    in_bunch, others = speeds[: bunch.count], speeds[bunch.count :]
    kept = np.abs(in_bunch - bunch.speed) <= NEAR * abs(bunch.speed)
    beats = np.abs(in_bunch - w) >= 0.5 * abs(w - bunch.speed)
    resting = np.abs(others - w) <= 0.1 * abs(w - bunch.speed)
    return float(in_bunch.mean()) if (kept & beats).all() and resting.all() else None
