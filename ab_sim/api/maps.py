"""Functions that repeat an analysis over many values of two parameters."""

from ab_sim.analysis.held_speed import as_speed
from ab_sim.analysis.maps import stability
from ab_sim.analysis.maps.plane import COUNT, Axis, Plane, axis
from ab_sim.analysis.maps.stability import COARSE, StabilityMap
from ab_sim.base.errors import InputError
from ab_sim.base.presentation import Progress
from ab_sim.scene.load import SceneLike, as_scene

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
        Called with the present work, the number of finished points and the total so far.

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
    >>> found = ab_sim.stability_map("thesis-hold", across, up)
    >>> found
    <StabilityMap: scene thesis-hold, points 6 x 3, over speed and ..., balanced ... %>
    >>> found.balanced.shape, bool(found.balanced[0, 0]), bool(found.balanced[0, -1])
    ((3, 6), False, True)
    """
    checked_scene = as_scene(scene)
    if coarse < 1 or coarse & (coarse - 1):
        raise InputError(f"coarse = {coarse!r}: must be a power of two: 1, 2, 4, 8, ...")
    first, second = _axis(across), _axis(up)
    if first.key == second.key:
        raise InputError(f"{first.key}: is on both axes; a map needs two parameters")
    plane = Plane(checked_scene, as_speed(speed, checked_scene), first, second)
    return stability.stability_map(plane, coarse, tell=progress)


def _axis(range_: Range) -> Axis:
    """Return a range as an axis.

    Raises:
        InputError: the range is invalid.
    """
    if not 3 <= len(range_) <= 4:
        raise InputError(f"{range_!r}: must be (key, first, last) or (key, first, last, count)")
    key, first, last = range_[:3]
    return axis(key, float(first), float(last), range_[3] if len(range_) == 4 else COUNT)
