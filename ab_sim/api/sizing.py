"""The call that sizes a balancer."""

from collections.abc import Sequence

from ab_sim.api.common import Progress
from ab_sim.api.design import executors_of
from ab_sim.design.sizing.size import RUNS, Sizing, run_sizing
from ab_sim.design.sizing.specification import (
    BALLS,
    DAMPING_RATIO,
    DENSITY,
    DRAG_TOLERANCE,
    LEFT,
    SETTLE,
    SHARE,
    SpecificationTexts,
    specification_of,
)
from ab_sim.design.sizing.spread_share import Running


def size(
    *,
    mass: str | float,
    critical_speed: str | float,
    speed: str | float,
    race_radius: str | float,
    race_width: str | float,
    unbalance: str | float | Sequence[float] | None = None,
    grade: str | float | None = None,
    damping_ratio: float = DAMPING_RATIO,
    acceleration: str | float | None = None,
    settle: str | float = SETTLE,
    density: str | float = DENSITY,
    balls: str | Sequence[int] = BALLS,
    share: float = SHARE,
    left: float = LEFT,
    drag_tolerance: float = DRAG_TOLERANCE,
    friction_arm: str | float = 0.0,
    runs: int = RUNS,
    seed: int = 0,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> Sizing:
    """Size a balancer: balls, drag and start-up from what a drive must do: ``ab-sim size``.

    Each claim is checked by running it. What is done is kept, as of ``sweep``.

    Parameters
    ----------
    mass : str or float
        All that moves on the suspension, without balls [kg]; as all numbers here, SI or a text
        with a unit, ``"100 g"``.
    critical_speed, speed : str or float
        Without balls, and at which it runs, above it [rad/s].
    race_radius, race_width : str or float
        Of the wall that balls roll on, and room for a ball's diameter [m].
    unbalance : str, float or two floats, optional
        The largest, or from least to largest, ``"0.1 g cm..0.3 g cm"`` [kg m].
    grade : str or float, optional
        Instead: ``"G6.3"`` or 6.3 [mm/s]; the largest unbalance is then mass times it over speed.
    damping_ratio : float, default 0.05
        Of the suspension.
    acceleration : str or float, optional
        Of the run-up [rad/s^2]; default: at speed within 1 s.
    settle : str or float, default 3
        Time from the running speed until a drive must be balanced [s].
    density : str or float, default "steel"
        Of balls: a name (steel, ceramic, tungsten carbide) or a number [kg/m^3].
    balls : str or sequence of int, default (2, 6)
        From how many to how many.
    share : float, default 0.9
        Of drives that must be balanced by then.
    left : float, default 0.1
        Of the largest unbalance, that may be left.
    drag_tolerance : float, default 0.2
        By which the drag of built drives is off, evenly to either side.
    friction_arm : str or float, default 0
        Of rolling friction [m], which runs then have, and predictions leave out.
    runs : int, default 400
        Drives, by which each share is checked.
    seed : int, default 0
        Of the random draws.
    workers : int, default 1
        Processes; more than one needs a program with ``if __name__ == "__main__":``.
    scheduler : str, optional
        Address of a Dask cluster that does the work instead; see ``sweep``.
    progress : callable, optional
        Called with what is done now, how many runs are done, and of how many.

    Returns
    -------
    Sizing
        ``candidates``, one for each number of balls; ``chosen``, ``hold``, ``scene``, ``runs``:
        None where nothing could be sized; ``claims``, each with what was predicted, what runs gave
        and a verdict; ``scene_text()``, the scene's file.

    Raises
    ------
    InputError
        A number cannot be; names it, what is allowed and what to do.

    Notes
    -----
    Balls: n m R >= U, of balls side by side. The drag's lower end: no circulating bunch at the
    running speed (Sommerfeld effect, Nayfeh and Mook 1979, 4.5), or the time to settle; its upper
    end: the time to settle. That time is estimated from growth rates, and safe for most starts
    only; the runs decide.

    Examples
    --------
    >>> import ab_sim
    >>> found = ab_sim.size(
    ...     mass="100 g", unbalance="0.3 g cm", critical_speed="100 rad/s", speed="200 rad/s",
    ...     race_radius="12 mm", race_width="4 mm", balls=[6], runs=100,
    ... )
    >>> found.chosen.count, found.hold, found.runs.share.value > 0.9
    (6, None, True)
    >>> 2e3 * found.chosen.balls.radius < 4.0
    True
    """
    texts = SpecificationTexts(
        mass, critical_speed, speed, race_radius, race_width, unbalance, grade, damping_ratio,
        acceleration, settle, density, balls, share, left, drag_tolerance, friction_arm,
    )  # fmt: skip
    executors = executors_of(workers, scheduler)
    return run_sizing(specification_of(texts), Running(runs, seed, executors, progress))
