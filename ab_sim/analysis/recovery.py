"""Response to a change of spindle speed along a raised cosine: amplitude and settling time.

Definitions of relative-stability 5.1: the change begins at t_0. The maximum amplitude r_p is the
largest whirl after t_0. From t_1 on the whirl stays within 1e-6 mm of its steady value; the
settling time is t_c = t_1 - t_0. Here the whirl must also stay in the band for at least the last
tenth of the time since the change. If the whirl rises to its steady value without overshoot, a case
that the source does not cover, t_0 is the end of the change.

The recovery over the race's drag shows the best drag (relative-stability 5.2): with more drag the
largest whirl falls and the settling time grows. The composite index is their weighted sum t_c + r_p
mean(t_c) / mean(r_p). It therefore depends on the set of drags over which the means are taken.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

from ab_sim.analysis.equilibria import Equilibria, RestingState, equilibria_of
from ab_sim.analysis.equilibria.resting import resting_system
from ab_sim.analysis.equilibria.states import resting_state
from ab_sim.analysis.result_cache import ResultCache
from ab_sim.analysis.startup import peak_whirl
from ab_sim.base.errors import InputError, SceneError, exact
from ab_sim.base.presentation import (
    LAST,
    Column,
    Columns,
    Presented,
    Progress,
    last_stretch,
    number,
)
from ab_sim.base.version import __version__
from ab_sim.drive import Drive
from ab_sim.drive.accuracy import resolve_accuracy
from ab_sim.drive.drive import AT_ONCE
from ab_sim.drive.trajectory import MAX_VALUES, Trajectory
from ab_sim.model.equations.neighbours import never_part, start_angles
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene
from ab_sim.scene.profiles import SpeedChangeProfile

BAND = 1e-9
"""Half-width of the band around the steady whirl [m]."""
STILL = 0.01
"""Fraction of the band within which a whirl is at rest if friction decides where balls rest.

It must stay there over the last stretch of the run.
"""
LONGEST = 8.0
"""Longest duration of a run that has not settled, as a multiple of the scene's duration."""
_KEPT = ("time", "x", "y", "vx", "vy")
"""Channels of the deck on the axes that turn with the rotor.

On these axes the path is smooth enough to interpolate between samples to a fraction of the band.
The whirl is the same as on fixed axes.
"""


class Recovery(NamedTuple):
    """Response to one change of speed; times count from the start of the run."""

    settling_time: float | None
    """Settling time t_c [s]; None if the whirl does not settle."""
    maximum_amplitude: float
    """Maximum amplitude r_p [m]."""
    peak_time: float
    """Time of the largest whirl [s]."""
    settled_at: float | None
    """Time t_1 from which the whirl stays in the band [s]; None if it does not settle."""
    steady_whirl: float
    """Whirl of the final resting state [m].

    Without such a state it is the last whirl of the run, because friction lets balls rest
    elsewhere.
    """
    label: str | None
    """Label of the resting state, as in ``ab-sim equilibria``; None if none is near."""
    lambda_max: float | None
    """Largest real part lambda_Rmax of the state's eigenvalues [1/s], without structural zeros."""
    verdict: str | None
    """Verdict of lambda_Rmax: stable, unstable or undecided."""
    rested_before: bool
    """True if the whirl was within the band over the last tenth of the time before the change."""
    duration: float
    """Duration of the run [s]."""


def recover(scene: Scene, band: float = BAND) -> Recovery:
    """Simulate a scene's change of speed until the whirl has settled.

    Parameters
    ----------
    scene
        Scene with a ``speed_change`` profile, at rest when the change begins. The run lasts for the
        scene's duration; if it has not settled by then, for up to ``LONGEST`` times that.
    band
        Half-width of the band around the steady whirl [m].

    Raises
    ------
    SceneError
        The scene has no such profile, ends before the change does, or has no resting states because
        the spindle's angle is in its equations or its speed is a state.
    InputError
        The run would have too many samples.
    DivergedError
        See ``Drive``.
    """
    change = _speed_change_of(scene)
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
        # With friction, balls may rest outside the resting states of the smooth equations.
        rests = state is not None or (bool(states.left_out) and _rests(path, STILL * band))
        recovery = _judge(change, path, state, rests, band)
        if recovery.settling_time is not None or end >= LONGEST * scene.duration:
            break
        end = min(2.0 * end, LONGEST * scene.duration)
    return recovery._replace(rested_before=len(before) > 1 and _rests(before, band))


def _speed_change_of(scene: Scene) -> SpeedChangeProfile:
    """Return the scene's change of speed.

    Raises
    ------
    SceneError
        The scene has no change of speed, or ends before the change does.
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
    """Refuse a scene whose longest run, at this step [s], would have too many samples."""
    most = MAX_VALUES / len(_KEPT) * step / LONGEST
    if scene.duration > most:
        raise InputError(
            f"duration = {exact(scene.duration)} s: must be at most {most:.10g} s with steps of "
            f"{step:g} s; use a longer solver.step or a shorter run"
        )


def _run(drive: Drive, end: float) -> np.ndarray:
    """Run to a time [s] and return samples of ``_KEPT``; the present one if already there."""
    steps = math.ceil(end / drive.step - 1e-9) - drive.steps
    if steps <= 0:
        return _kept(drive.present())
    parts = range(0, steps, AT_ONCE)
    return np.concatenate([_kept(drive.advance(min(AT_ONCE, steps - done))) for done in parts])


def _kept(run: Trajectory) -> np.ndarray:
    """Return the channels ``_KEPT`` of a run, shape (samples, 5)."""
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
    """Return the recovery of a run, with ``rested_before`` not yet decided.

    Parameters
    ----------
    change
        The scene's change of speed.
    path
        Samples of ``_KEPT`` from the beginning of the change, shape (samples, 5).
    state
        Resting state that the drive has reached; None if there is none.
    rests
        True if the drive may have come to rest.
    band
        Half-width of the band around the steady whirl [m].
    """
    run = Trajectory(_KEPT, path)
    time, whirl = run["time"], run.whirl
    steady = float(whirl[-1]) if state is None else state.W
    peak, peak_time = peak_whirl(run)
    settled = None
    if rests:
        settled = settled_at(run, steady, band)
        if time[-1] - settled < LAST * (time[-1] - change.start_time):
            settled = None
    begins = peak_time if peak > steady + band else change.start_time + change.duration
    return Recovery(
        settling_time=None if settled is None else max(0.0, settled - begins),
        maximum_amplitude=peak,
        peak_time=peak_time,
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
    """Return the resting state that a drive has reached; None if there is no stable one.

    On a continuum, such as the balanced positions of three balls, the state at the balls' angles is
    returned.

    Parameters
    ----------
    scene
        Scene of ``states``.
    states
        Resting states at the final speed.
    u
        The deck's displacement on the rotating axes [m], shape (2,).
    theta
        Ball angles [rad], shape (balls,).
    band
        Largest difference of the whirl from the state's [m].
    """
    state = min(states.branches, key=lambda state: float(np.hypot(*(u - state.u))), default=None)
    if state is None or abs(np.hypot(*u) - state.W) > band:
        return None
    if state.structural_zeros:
        system, zeros = resting_system(scene), state.structural_zeros
        label = state.label.partition(",")[0]  # without the suffix ", worst" or ", best"
        state = resting_state(system, states.speed, label, state.u, theta, zeros)
    return None if state.stable is False else state


def settled_at(run: Trajectory, steady: float, band: float) -> float:
    """Return the time from which the whirl stays within a band [s], interpolated between samples.

    Parameters
    ----------
    run
        Samples with positions and velocities on the rotating axes.
    steady
        Middle of the band [m].
    band
        Half-width of the band [m].
    """
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
    """Return whether the whirl in ``_KEPT`` samples stays in a band [m] over the last stretch."""
    last = Trajectory(_KEPT, path[-last_stretch(len(path)) :])
    return bool(np.ptp(np.hypot(last["x"], last["y"])) <= 2.0 * band)


DRAGS = (0.1, 0.2, 0.3, 0.4, 0.5)
"""Drags [N s/m] that reproduce the figures of relative-stability, which does not state any."""
DRAG = "effects.viscous_drag.coefficient"
"""Key of the drag."""


@dataclass(frozen=True)
class Composite:
    """Composite index of settling time and maximum amplitude."""

    factor: float
    """Weight of the maximum amplitude in ``index`` [s/m]."""
    index: tuple[float | None, ...]
    """Index at each drag [s]; None if the whirl does not settle."""
    best: int
    """Position of the smallest entry of ``index``."""


@dataclass(frozen=True, repr=False)
class RecoveryOverDrag(Presented):
    """Recovery of a scene at its own drag and others, and with one ball of the same mass.

    See ``ab_sim.recovery``.
    """

    _picture = "recovery"

    scene: str
    """Name of the scene."""
    from_speed: float
    to_speed: float
    """Final spindle speed [rad/s]; ``from_speed`` is the initial one."""
    band: float
    """Half-width of the band around the steady whirl [m]."""
    balls: int
    """Number of balls."""
    balls_coincide: bool
    """True if equal balls start at one angle: they stay together in a simulation."""
    drag: float
    """Drag of the scene [N s/m]."""
    at_scene_drag: Recovery
    """Recovery at ``drag``."""
    drags: tuple[float, ...]
    """Drags [N s/m], in the order requested."""
    at_drags: tuple[Recovery, ...]
    """Recovery at each of ``drags``."""
    one_ball: tuple[Recovery, ...] | None
    """Recovery with one ball that has the mass of all balls.

    The first entry is at the scene's own drag, the others are at ``drags``. None if the scene has
    one ball.
    """

    @property
    def composite(self) -> Composite | None:
        """Composite index over ``drags``; None if the whirl settles at no drag."""
        return composite_of(self.at_drags)

    @property
    def best_drag(self) -> float | None:
        """Drag with the smallest composite index [N s/m]."""
        return _best(self.drags, self.at_drags)

    def _facts(self) -> dict[str, str]:
        return {
            "scene": self.scene,
            "speed": f"{self.from_speed:g} to {self.to_speed:g} rad/s",
            "settling time": number(self.at_scene_drag.settling_time, "s"),
            "amplitude": number(self.at_scene_drag.maximum_amplitude, "m"),
            "best drag": number(self.best_drag, "N s/m"),
        }

    def _columns(self) -> Columns:
        """Return a row per run: all balls, then one ball; each with the scene's drag first."""
        drags = (self.drag, *self.drags)
        runs = (self.at_scene_drag, *self.at_drags, *(self.one_ball or ()))
        groups = len(runs) // len(drags)
        return {
            "balls": Column("1", [n for n in (self.balls, 1)[:groups] for _ in drags]),
            "drag": Column("N s/m", [*drags] * groups),
            "settling_time": Column("s", [run.settling_time for run in runs]),
            "maximum_amplitude": Column("m", [run.maximum_amplitude for run in runs]),
            "lambda_max": Column("1/s", [run.lambda_max for run in runs]),
            "label": Column(None, [run.label for run in runs]),
            "verdict": Column(None, [run.verdict for run in runs]),
        }

    def report(self) -> dict[str, object]:
        """Return all results as JSON-able values in SI units; see docs/reference/json.md."""
        one = self.one_ball
        return {
            "scene": self.scene,
            "from_speed": self.from_speed,
            "to_speed": self.to_speed,
            "band": self.band,
            "balls": self.balls,
            "drag": self.drag,
            **self.at_scene_drag._asdict(),
            "over_drag": _over(self.drags, self.at_drags),
            "best_drag": self.best_drag,
            "one_ball": None
            if one is None
            else {
                **one[0]._asdict(),
                "over_drag": _over(self.drags, one[1:]),
                "best_drag": _best(self.drags, one[1:]),
            },
            "version": __version__,
        }


def _best(drags: Sequence[float], recoveries: Sequence[Recovery]) -> float | None:
    """Return the drag with the smallest composite index [N s/m]; None if no run settles."""
    composite = composite_of(recoveries)
    return None if composite is None else drags[composite.best]


def composite_of(recoveries: Sequence[Recovery]) -> Composite | None:
    """Return the composite index of recoveries that differ in drag; None if none settles."""
    settled = [recovery for recovery in recoveries if recovery.settling_time is not None]
    if not settled:
        return None
    times = np.array([recovery.settling_time for recovery in settled], float)
    factor = float(times.mean() / np.mean([recovery.maximum_amplitude for recovery in settled]))
    index = tuple(
        None
        if recovery.settling_time is None
        else recovery.settling_time + factor * recovery.maximum_amplitude
        for recovery in recoveries
    )
    best = int(np.nanargmin(np.array(index, float)))
    return Composite(factor, index, best)


def recovery_over_drag(
    scene: Scene, drags: Sequence[float] = DRAGS, tell: Progress | None = None, band: float = BAND
) -> RecoveryOverDrag:
    """Return the recovery at the scene's own drag and others, with all balls and with one.

    Previous results are taken from the cache (``ResultCache``).

    Parameters
    ----------
    scene
        Scene with balls, see ``recover``.
    drags
        Coefficients [N s/m].
    tell
        Called with the current task, the number of finished tasks and the total.
    band
        Half-width of the band around the steady whirl [m].

    Raises
    ------
    SceneError, InputError, DivergedError
        See ``recover``; or the scene has no balls, or does not accept a drag.
    """
    change = _speed_change_of(scene)
    if scene.balls.count == 0:
        raise SceneError("balls.count = 0: must be at least 1 for a recovery over drag")
    drag = scene.effects["viscous_drag"].coefficient if "viscous_drag" in scene.effects else 0.0
    bases = [scene] if scene.balls.count == 1 else [scene, in_one_ball(scene)]
    work = [case for base in bases for case in (base, *(with_drag(base, d) for d in drags))]
    recoveries = []
    for done, case in enumerate(work):
        if tell is not None:
            tell(_task(case), done, len(work))
        recoveries.append(kept_recovery(case, band))
    several = 1 + len(drags)
    return RecoveryOverDrag(
        scene.name,
        scene.start.speed,
        change.to_speed,
        band,
        scene.balls.count,
        bool(never_part(scene)),
        drag,
        recoveries[0],
        tuple(drags),
        tuple(recoveries[1:several]),
        tuple(recoveries[several:]) or None,
    )


def kept_recovery(scene: Scene, band: float = BAND) -> Recovery:
    """Return the result of ``recover``, from the cache if it was computed before."""
    return Recovery(**ResultCache(_recovered).of(scene, band=band))


def _recovered(scene: Scene, band: float) -> dict[str, Any]:
    """Return ``recover`` as JSON-able values, for the cache."""
    return recover(scene, band)._asdict()


def with_drag(scene: Scene, drag: float) -> Scene:
    """Return the scene with another drag of the race [N s/m].

    Raises
    ------
    SceneError
        The scene does not accept the drag.
    """
    return changed_scene(scene, {DRAG: drag}, "drag")


def in_one_ball(scene: Scene) -> Scene:
    """Return the scene with one ball of the total mass, at the mass-weighted mean angle."""
    balls = scene.balls
    mean = np.array(balls.masses) @ np.exp(1j * np.array(start_angles(scene)))
    radius = balls.radius[0] if isinstance(balls.radius, tuple) else balls.radius
    changes: dict[str, Any] = {
        "name": f"{scene.name}, one ball",
        "balls": {"count": 1, "mass": balls.total_mass, "race": balls.races[0]},
        "start.ball_angles": [float(np.angle(mean))],
        "start.ball_rates": [0.0],
    }
    if radius is not None:
        changes["balls"]["radius"] = radius
    return changed_scene(scene, changes, "one ball")


def _task(scene: Scene) -> str:
    """Return the number of balls and the drag as the name of a task for progress."""
    drag = scene.effects["viscous_drag"].coefficient if "viscous_drag" in scene.effects else 0.0
    return f"{scene.balls.count} balls, drag {drag:g} N s/m"


def _over(drags: Sequence[float], recoveries: Sequence[Recovery]) -> list[dict[str, Any]]:
    """Return a JSON-able row for each drag, with its recovery and its composite index."""
    composite = composite_of(recoveries)
    indices = (None,) * len(drags) if composite is None else composite.index
    return [
        {"drag": drag, **recovery._asdict(), "composite_index": index}
        for drag, recovery, index in zip(drags, recoveries, indices, strict=True)
    ]
