"""Functions that analyse resting states, stability, vibration and recovery of a drive."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from ab_sim.analysis.equilibria import Equilibria, equilibria_of, kept_branches
from ab_sim.analysis.floquet import STARTS, Followed, follow, held_speed, solutions_of
from ab_sim.analysis.floquet.follow import SPEED, case_of
from ab_sim.analysis.held_speed import as_speed
from ab_sim.analysis.maps import stability
from ab_sim.analysis.maps.plane import COUNT, Axis, Plane, axis
from ab_sim.analysis.maps.refine import check_coarse
from ab_sim.analysis.maps.stability import COARSE, StabilityMap
from ab_sim.analysis.modes import NaturalVibration, vibration_of
from ab_sim.analysis.recovery import BAND, DRAGS, RecoveryOverDrag, recovery_over_drag
from ab_sim.api.results import BranchesOverSpeed, PeriodicSolutions
from ab_sim.base.errors import InputError
from ab_sim.base.presentation import Progress
from ab_sim.scene.load import SceneLike, as_scene
from ab_sim.scene.model import Scene

SPEEDS = 120
"""Number of evenly spaced speeds at which the stability of branches is computed."""


def equilibria(scene: SceneLike, speed: float | None = None) -> Equilibria:
    """Find all states in which deck and balls rest on the rotor at a speed: ``ab-sim equilibria``.

    Parameters
    ----------
    scene : Scene, str or Path
        Scene; its friction and contact are left out, as ``left_out`` of the result states.
    speed : float, optional
        Constant w [rad/s]; default: the final speed of the scene.

    Returns
    -------
    Equilibria
        ``branches``: for each state its label (``p+q``: p balls on the side of the displacement, q
        opposite; ``balanced``), displacement u [m], shape (2,), ball angles theta [rad], shape
        (balls,), eigenvalues [1/s], complex, shape (4 + 2 balls,), and its verdict.

    Raises
    ------
    SceneError
        The scene is not valid, its equations contain the spindle's angle, or its speed is a state.
    InputError
        The speed is not a number, or beyond 1e5 rad/s.

    References
    ----------
    Lu and Hung (2008), equations (10) to (36), "three-ball"; "relative-stability" (NSC 2007), (15)
    to (24); both in docs/papers.

    Examples
    --------
    >>> import ab_sim
    >>> states = ab_sim.equilibria("thesis-hold", speed=300.0)
    >>> states
    <Equilibria: scene thesis-hold, speed 300 rad/s, states 4, stable balanced>
    >>> [(state.label, state.verdict) for state in states.branches][-1]
    ('balanced', 'stable')
    """
    checked_scene = as_scene(scene)
    return equilibria_of(checked_scene, as_speed(speed, checked_scene))


def branches(
    scene: SceneLike,
    speed: float | None = None,
    *,
    speeds: ArrayLike | None = None,
    progress: Progress | None = None,
) -> BranchesOverSpeed:
    """Follow all resting states over the spindle's speed, with folds and borders of stability.

    Parameters
    ----------
    scene : Scene, str or Path
        See ``equilibria``.
    speed : float, optional
        Speed that the picture marks [rad/s]; default: the final speed of the scene.
    speeds : array_like of float, shape (n,), optional
        Speeds at which stability is computed [rad/s], above 0 and increasing; default: 120 up to
        ``spindle.max_speed``, and more about the critical speed.
    progress : callable, optional
        Called with the name of the current work, the finished count and the total.

    Returns
    -------
    BranchesOverSpeed
        ``over_speed`` with branches, ``folds``, ``crossings`` and ``without_stable_state`` [rad/s].

    Raises
    ------
    SceneError
        See ``equilibria``.
    InputError
        ``speeds`` do not increase.

    Examples
    --------
    >>> import ab_sim
    >>> result = ab_sim.branches("thesis-hold", speeds=[90.0, 100.0, 110.0, 120.0])
    >>> [(round(low, 1), round(high, 1)) for low, high in result.over_speed.without_stable_state]
    [(98.2, 104.9)]
    """
    checked_scene = as_scene(scene)
    at = as_speed(speed, checked_scene)
    if speeds is None:
        values = speeds_of_branches(checked_scene, max(abs(at), checked_scene.spindle.max_speed))
    else:
        values = np.asarray(speeds, float)
    tell: Progress = progress or (lambda what, done, of: None)
    return BranchesOverSpeed(
        checked_scene, equilibria_of(checked_scene, at), kept_branches(checked_scene, values, tell)
    )


def speeds_of_branches(scene: Scene, top: float) -> np.ndarray:
    """Return evenly spaced speeds [rad/s], and more near the critical one, where branches bend."""
    speeds = np.linspace(top / SPEEDS, top, SPEEDS)
    critical = scene.critical_speed or top
    near = np.geomspace(1e-3, 0.2, 16)
    speeds = np.concatenate([speeds, critical * (1.0 - near), critical * (1.0 + near)])
    return np.unique(speeds[(speeds > 0.0) & (speeds <= top)])


def floquet(scene: SceneLike, speed: float | None = None, start: str = "") -> PeriodicSolutions:
    """Find motions that repeat with every turn, and their multipliers: ``ab-sim floquet``.

    Parameters
    ----------
    scene : Scene, str or Path
        Without friction, contact and motor.
    speed : float, optional
        Constant w [rad/s]; default: the final speed of the scene.
    start : str, optional
        Start of the search: ``start``, ``balanced`` or ``settled``; default: from each.

    Returns
    -------
    PeriodicSolutions
        Distinct solutions, each with its multipliers, complex, shape (states,), the largest first.

    Raises
    ------
    SceneError
        The scene has events, or its speed is a state.
    InputError
        The speed is 0, or there is no such start.

    References
    ----------
    Nayfeh and Balachandran, Applied Nonlinear Dynamics (1995), 3.2 and 6.5.

    Examples
    --------
    >>> import ab_sim
    >>> result = ab_sim.floquet("nsc-case-1", 300.0, start="balanced")
    >>> len(result), result[0].verdict, result[0].largest < 1.0
    (1, 'stable', True)
    """
    checked_scene = as_scene(scene)
    at = held_speed(checked_scene) if speed is None else as_speed(speed, checked_scene)
    return PeriodicSolutions(checked_scene, at, tuple(solutions_of(checked_scene, at, start)))


def follow_floquet(
    scene: SceneLike,
    key: str,
    values: Sequence[float],
    *,
    speed: float | None = None,
    progress: Callable[[int], None] | None = None,
) -> Followed:
    """Follow a periodic solution over a parameter, and locate where it loses stability.

    Parameters
    ----------
    scene : Scene, str or Path
        See ``floquet``.
    key : str
        Dotted key of a scene, e.g. ``race.radius``, or ``speed``.
    values : sequence of float
        Values of that parameter, SI, at least two, increasing or decreasing.
    speed : float, optional
        Constant w [rad/s], unless it is the parameter; default: as in ``floquet``.
    progress : callable, optional
        Called with the number of finished values.

    Returns
    -------
    Followed
        ``points``, one for each value, and ``borders`` at which the largest modulus is 1.

    Raises
    ------
    SceneError
        A value gives no valid scene, or see ``floquet``.
    InputError
        There are fewer than two values, or a speed is given twice.

    Examples
    --------
    >>> import ab_sim
    >>> result = ab_sim.follow_floquet("nsc-case-1", "speed", [300.0, 310.0])
    >>> [point.solution.verdict for point in result.points], result.borders
    (['stable', 'stable'], ())
    """
    checked_scene, wanted = as_scene(scene), [float(value) for value in values]
    if len(wanted) < 2:
        raise InputError(f"values = {wanted}: must be at least two")
    if key == SPEED and speed is not None:
        raise InputError(
            "speed: is the key to vary, so it cannot have a constant value too; leave speed= out"
        )
    at = None if speed is None else as_speed(speed, checked_scene)
    case = case_of(checked_scene, key, wanted, at, f"{key} = ")
    return follow(key, case, wanted, tuple(STARTS), progress or (lambda done: None))


def modes(scene: SceneLike, speed: float = 0.0) -> NaturalVibration:
    """Compute natural frequencies, damping and mode shapes of the deck: ``ab-sim modes``.

    Parameters
    ----------
    scene : Scene, str or Path
        Rotor and balls are averaged over a turn; the balls spread evenly and turn with the rotor.
    speed : float, default 0
        Speed of the spindle [rad/s].

    Returns
    -------
    NaturalVibration
        ``modes`` by frequency, each with frequency [rad/s], damping ratio and shape, complex, shape
        (coordinates,); ``over_speed``, a Campbell diagram with the critical speeds [rad/s].

    Raises
    ------
    SceneError
        The deck has no position at rest.
    InputError
        The speed is not a number, or beyond 1e5 rad/s.

    References
    ----------
    Genta, Dynamics of Rotating Systems (2005), chapters 2 and 3.

    Examples
    --------
    >>> import ab_sim
    >>> result = ab_sim.modes("couple-unbalance", 500.0)
    >>> [f"{mode.frequency:.0f} {mode.sense}" for mode in result.modes][0]
    '...'
    """
    checked_scene = as_scene(scene)
    return vibration_of(checked_scene, as_speed(speed, checked_scene))


def recovery(
    scene: SceneLike,
    drags: Sequence[float] = DRAGS,
    *,
    band: float = BAND,
    progress: Progress | None = None,
) -> RecoveryOverDrag:
    """Compute the recovery from a change of speed, over drag: ``ab-sim recovery``.

    Parameters
    ----------
    scene : Scene, str or Path
        Its profile is a ``speed_change``, and it has balls.
    drags : sequence of float, optional
        Drags of the race on a ball [N s/m].
    band : float, default 1e-9
        Half-width of the band around the steady whirl in which the run counts as settled [m].
    progress : callable, optional
        Called with the name of the current work, the finished count and the total.

    Returns
    -------
    RecoveryOverDrag
        ``at_scene_drag``, and ``at_drags``, one for each of ``drags``: settling time [s] and
        largest whirl [m]; ``best_drag`` [N s/m]; ``one_ball``, the same with all balls in one.

    Raises
    ------
    SceneError
        The scene has no such profile, no ball, or no resting state.
    InputError
        The run would not fit into memory.
    DivergedError
        The state went beyond all bounds.

    References
    ----------
    "relative-stability" (NSC 2007), sections 5.1 and 5.2: docs/papers.

    Examples
    --------
    >>> import ab_sim
    >>> result = ab_sim.recovery("nsc-case-1", drags=[0.2, 0.4])
    >>> result.best_drag, round(result.at_scene_drag.settling_time, 2)
    (0.2, 2.03)
    """
    return recovery_over_drag(as_scene(scene), tuple(drags), progress, band)


Range = tuple[str, float, float] | tuple[str, float, float, int]
"""Dotted key of a scene or ``speed``, first value, last value, and number of values (default
200)."""


def stability_map(
    scene: SceneLike,
    across: Range,
    up: Range,
    *,
    speed: float | None = None,
    coarse: int = COARSE,
    progress: Progress | None = None,
) -> StabilityMap:
    """Map the stable kinds of resting states over two parameters: ``ab-sim stability --map``.

    Only points near borders are computed, and they are kept on disk.

    Parameters
    ----------
    scene : Scene, str or Path
        See ``equilibria``.
    across, up : (str, float, float) or (str, float, float, int)
        Key of the parameter, dotted, or ``speed``; its first and last value, SI; number of values,
        from 2 to 2000, by default 200.
    speed : float, optional
        Constant w [rad/s], if it is not on an axis; default: the last one of the scene's profile.
    coarse : int, default 8
        Spacing of the points that are computed first, a power of two. Regions of fewer points may
        be missed; 1 computes every point.
    progress : callable, optional
        Called with the name of the current work, the number of finished points and the total
        so far.

    Returns
    -------
    StabilityMap
        ``labels``, integers of shape (values up, values across), ``balanced``, booleans of that
        shape, and ``shares`` of the plane by label; ``circulating``, integers of that shape, 1
        where all balls can circulate in a stable bunch, and ``coexisting``, where balance is
        stable, too.

    Raises
    ------
    SceneError
        A corner or a point is not a valid scene, or has no resting states; the message has key and
        value.
    InputError
        A parameter does not affect resting states, a range cannot be used, ``coarse`` is not a
        power of two, or both axes have one key.

    Examples
    --------
    >>> import ab_sim
    >>> across, up = ("speed", 50.0, 300.0, 6), ("effects.suspension.damping", 0.1, 4.0, 3)
    >>> result = ab_sim.stability_map("thesis-hold", across, up)
    >>> result
    <StabilityMap: scene thesis-hold, points 6 x 3, over speed and ..., balanced ... %>
    >>> result.balanced.shape, bool(result.balanced[0, 0]), bool(result.balanced[0, -1])
    ((3, 6), False, True)
    """
    checked_scene = as_scene(scene)
    check_coarse(coarse, f"coarse = {coarse!r}")
    first, second = _axis(across), _axis(up)
    if first.key == second.key:
        raise InputError(f"{first.key}: is on both axes; a map needs two parameters")
    plane = Plane(checked_scene, as_speed(speed, checked_scene), first, second)
    return stability.stability_map(plane, coarse, tell=progress)


def _axis(range_: Range) -> Axis:
    """Return a range as an axis.

    Raises
    ------
    InputError
        The range is invalid.
    """
    if not 3 <= len(range_) <= 4:
        raise InputError(f"{range_!r}: must be (key, first, last) or (key, first, last, count)")
    key, first, last = range_[:3]
    return axis(key, float(first), float(last), range_[3] if len(range_) == 4 else COUNT)
