"""What follows a change of the spindle's speed along a raised cosine: how far, for how long.

Definitions of relative-stability 5.1: the maximum amplitude r_p is the largest whirl after the
change has begun, at t_0; from t_1 on the whirl stays within 1e-6 mm of its steady value; the
settling time is t_c = t_1 - t_0. It has to stay there for the last tenth of the time since the
change at least. Where it rises to its steady value and not beyond, which the
report does not think of, t_0 is the end of the change.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

from ab_sim.accuracy import resolve_accuracy
from ab_sim.analysis.equilibria import Equilibria, RestingState, equilibria_of
from ab_sim.analysis.equilibria.resting import resting_system
from ab_sim.analysis.equilibria.states import resting_state
from ab_sim.analysis.merits import LAST
from ab_sim.analysis.startup import peak_whirl
from ab_sim.drive import Drive
from ab_sim.drive.drive import AT_ONCE
from ab_sim.drive.trajectory import MAX_VALUES, Trajectory
from ab_sim.errors import InputError, SceneError, exact
from ab_sim.scene.model import Scene
from ab_sim.scene.profiles import SpeedChangeProfile

BAND = 1e-9
"""Half the width of the band around the steady whirl [m]."""
STILL = 0.01
"""Where friction lets balls rest in other places than the resting states, the whirl rests if it
stays within this share of the band, over the last stretch of the run."""
LONGEST = 8.0
"""A run that has not settled goes on, up to so many times the scene's duration."""
_KEPT = ("time", "x", "y", "vx", "vy")
"""Of the deck on the axes that turn with the rotor, where its path is smooth enough to be followed
between samples to a fraction of the band; whirl is the same there."""


class Recovery(NamedTuple):
    """What follows one change of speed. Times count from the start of the run."""

    settling_time: float | None
    """t_c [s]; None: it does not settle."""
    maximum_amplitude: float
    """r_p [m]."""
    peak_time: float
    """When the whirl is largest [s]."""
    settled_at: float | None
    """t_1 [s]."""
    steady_whirl: float
    """Of the resting state that it goes to [m]; of none, the last whirl of the run: friction lets
    balls rest elsewhere."""
    label: str | None
    """That state's, as ``ab-sim equilibria`` calls it; None: it is near no resting state."""
    lambda_max: float | None
    """lambda_Rmax of that state, the largest real part of its eigenvalues [1/s]; structural zeros
    do not count."""
    verdict: str | None
    """What lambda_Rmax says: stable, unstable or undecided."""
    rested_before: bool
    """Whether the whirl kept within the band over the last tenth of the time before the change."""
    duration: float
    """Of the run [s]."""


def recover(scene: Scene, band: float = BAND) -> Recovery:
    """Run a scene's change of speed until it has settled.

    Args:
        scene: its profile is a ``speed_change``, and it rests where that begins. It runs for the
            scene's duration, and if it has not settled then, for up to ``LONGEST`` times that.
        band: half the width of the band around the steady whirl [m].

    Raises:
        SceneError: the scene has no such profile, ends before the change does, or has nowhere to
            rest: the spindle's angle is in its equations, or its speed is a state.
        InputError: the run would be absurdly long.
        DivergedError: see ``Drive``.
    """
    change = speed_change_of(scene)
    scene, _ = resolve_accuracy(scene)
    states = equilibria_of(scene, change.to_speed)
    drive = Drive(scene)
    _check_length(scene, drive.step)
    before = _run(drive, change.start_time)
    path, end = before[-1:], scene.duration
    while True:
        path = np.concatenate([path, _run(drive, end)])
        now = drive.observe()
        state = nearest_state(scene, states, now.u, now.theta, band)
        # Friction lets balls rest elsewhere.
        rests = state is not None or (bool(states.left_out) and _rests(path, STILL * band))
        found = _judge(change, path, state, rests, band)
        if found.settling_time is not None or end >= LONGEST * scene.duration:
            break
        end = min(2.0 * end, LONGEST * scene.duration)
    return found._replace(rested_before=len(before) > 1 and _rests(before, band))


def speed_change_of(scene: Scene) -> SpeedChangeProfile:
    """The scene's change of speed.

    Raises:
        SceneError: it has none, or ends before it is over.
    """
    change = scene.profile
    if not isinstance(change, SpeedChangeProfile):
        has = "none" if change is None else change.kind
        raise SceneError(
            f"profile.kind = {has}: {scene.name} has no change of speed to recover from; take a "
            "scene with profile: {kind: speed_change, start_time: ..., duration: ..., to_speed: "
            "...}, as nsc-case-1"
        )
    over = change.start_time + change.duration
    if scene.duration <= over:
        raise SceneError(
            f"duration = {exact(scene.duration)} s: ends before the change of speed is over, at "
            f"{over:.9g} s; make it longer"
        )
    return change


def _check_length(scene: Scene, step: float) -> None:
    most = MAX_VALUES / len(_KEPT) * step / LONGEST
    if scene.duration > most:
        raise InputError(
            f"duration = {exact(scene.duration)} s: with steps of {step:g} s at most {most:.10g} s "
            "fit; use a longer solver.step or a shorter run"
        )


def _run(drive: Drive, end: float) -> np.ndarray:
    """On to a time [s]: samples of ``_KEPT``, the present one if it is there already."""
    steps = math.ceil(end / drive.step - 1e-9) - drive.steps
    if steps <= 0:
        return _kept(drive.present())
    parts = range(0, steps, AT_ONCE)
    return np.concatenate([_kept(drive.advance(min(AT_ONCE, steps - done))) for done in parts])


def _kept(run: Trajectory) -> np.ndarray:
    turn = np.exp(-1j * run["angle"])
    place, velocity = run["x"] + 1j * run["y"], run["vx"] + 1j * run["vy"]
    u, rate = place * turn, (velocity - 1j * run["speed"] * place) * turn
    return np.stack([run["time"], u.real, u.imag, rate.real, rate.imag], axis=1)


def _judge(
    change: SpeedChangeProfile,
    path: np.ndarray,
    state: RestingState | None,
    rests: bool,
    band: float,
) -> Recovery:
    """What a run shows that has come to a resting state, or to none; ``rests``: it can settle."""
    run = Trajectory(_KEPT, path)
    time, whirl = run["time"], run.whirl
    steady = float(whirl[-1]) if state is None else state.W
    peak, at = peak_whirl(run)
    settled = None
    if rests:
        settled = settled_at(run, steady, band)
        if time[-1] - settled < LAST * (time[-1] - change.start_time):
            settled = None
    begins = at if peak > steady + band else change.start_time + change.duration
    return Recovery(
        settling_time=None if settled is None else max(0.0, settled - begins),
        maximum_amplitude=peak,
        peak_time=at,
        settled_at=settled,
        steady_whirl=steady,
        label=None if state is None else state.label,
        lambda_max=None if state is None else state.lambda_max,
        verdict=None if state is None else state.verdict,
        rested_before=True,
        duration=float(time[-1]),
    )


def nearest_state(
    scene: Scene, states: Equilibria, u: np.ndarray, theta: np.ndarray, band: float
) -> RestingState | None:
    """The resting state that a drive has come to; None if it is at none, or at an unstable one.

    Of a continuum of them, as balanced positions of three balls are, the one where the balls are.

    Args:
        scene: of which ``states`` are.
        states: at the speed that is held.
        u: the deck's displacement on the rotating axes [m], shape (2,).
        theta: ball angles [rad], shape (balls,).
        band: how near its whirl has to be to the state's [m].
    """
    state = min(states.branches, key=lambda state: float(np.hypot(*(u - state.u))), default=None)
    if state is None or abs(np.hypot(*u) - state.W) > band:
        return None
    if state.structural_zeros:
        system, zeros = resting_system(scene), state.structural_zeros
        label = state.label.partition(",")[0]  # of its worst, best or symmetric position
        state = resting_state(system, states.speed, label, state.u, theta, zeros)
    return None if state.stable is False else state


def settled_at(run: Trajectory, steady: float, band: float) -> float:
    """From when on the whirl is within the band [s], found between samples."""
    time, whirl = run["time"], run.whirl
    outside = np.flatnonzero(np.abs(whirl - steady) > band)
    if len(outside) == 0:
        return float(time[0])
    k = int(outside[-1])
    if k + 1 == len(time):
        return float(time[k])
    near = slice(k, k + 2)
    path = CubicHermiteSpline(
        time[near], run.position[near], np.column_stack([run["vx"][near], run["vy"][near]])
    )
    edge = steady + math.copysign(band, whirl[k] - steady)
    return float(brentq(lambda t: math.hypot(*path(t)) - edge, time[k], time[k + 1]))


def _rests(path: np.ndarray, band: float) -> bool:
    """Whether the whirl keeps within a band over the last stretch."""
    last = path[-max(1, round(LAST * len(path))) :]
    return bool(np.ptp(np.hypot(last[:, 1], last[:, 2])) <= 2.0 * band)
