"""Function that sizes a balancer."""

from collections.abc import Sequence

from ab_sim.api.design import executor_of
from ab_sim.base.presentation import Progress
from ab_sim.design.sizing.claims import Running
from ab_sim.design.sizing.size import RUNS, Sizing, run_sizing
from ab_sim.design.sizing.specification import (
    BALLS,
    DAMPING_RATIO,
    DENSITY,
    DRAG_TOLERANCE,
    RESIDUAL,
    SETTLE,
    SHARE,
    SpecificationTexts,
    specification_of,
)


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
    residual: float = RESIDUAL,
    drag_tolerance: float = DRAG_TOLERANCE,
    friction_arm: str | float = 0.0,
    runs: int = RUNS,
    seed: int = 0,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> Sizing:
    """Size a balancer: balls, drag and start-up from what a drive must do: ``ab-sim size``.

    Each claim is checked by runs. Finished runs are kept, as in ``sweep``.

    Parameters
    ----------
    mass : str or float
        Moving mass on the suspension, without balls [kg]; like all numbers here, SI or a text with
        a unit, ``"100 g"``.
    critical_speed, speed : str or float
        Critical speed without balls, and running speed above it [rad/s].
    race_radius, race_width : str or float
        Radius of the wall that balls roll on, and largest diameter of a ball [m].
    unbalance : str, float or two floats, optional
        Largest unbalance, or its range, ``"0.1 g cm..0.3 g cm"`` [kg m].
    grade : str or float, optional
        Instead of the unbalance: ``"G6.3"`` or 6.3 [mm/s]; the largest unbalance is then mass times
        it over speed.
    damping_ratio : float, default 0.05
        Damping ratio of the suspension.
    acceleration : str or float, optional
        Acceleration of the run-up [rad/s^2]; default: at speed within 1 s.
    settle : str or float, default 3
        Time from the running speed until a drive must be balanced [s].
    density : str or float, default "steel"
        Density of the balls: a name (steel, ceramic, tungsten carbide) or a number [kg/m^3].
    balls : str or sequence of int, default (2, 6)
        Range of the number of balls.
    share : float, default 0.9
        Share of drives that must be balanced by then.
    residual : float, default 0.1
        Residual unbalance up to which a drive is balanced, relative to the largest unbalance.
    drag_tolerance : float, default 0.2
        Relative tolerance of the drag of built drives, uniform to both sides.
    friction_arm : str or float, default 0
        Lever arm of the balls' rolling friction [m]; only the runs include it, the predictions do
        not.
    runs : int, default 400
        Number of drives with which each share is checked.
    seed : int, default 0
        Seed of the random draws.
    workers : int, default 1
        Number of processes; more than one needs a program with ``if __name__ == "__main__":``.
    scheduler : str, optional
        Address of a Dask cluster that does the work instead; see ``sweep``.
    progress : callable, optional
        Called with the name of the current work, the number of finished runs and the total.

    Returns
    -------
    Sizing
        ``candidates``, one for each number of balls; ``chosen``, ``hold``, ``scene``, ``runs``:
        None if nothing could be sized; ``claims``, each with prediction, result of the runs and
        verdict; ``scene_text()``, the scene's file.

    Raises
    ------
    InputError
        A number is not allowed; the message has name, allowed range and remedy.

    Notes
    -----
    Balls: n m R >= U, of balls side by side. The drag's lower end: no circulating bunch at the
    running speed (Sommerfeld effect, Nayfeh and Mook 1979, 4.5), or the time to settle; its upper
    end: the time to settle. That time is estimated from growth rates, and safe for most starts
    only; the runs decide.

    Examples
    --------
    >>> import ab_sim
    >>> result = ab_sim.size(
    ...     mass="100 g", unbalance="0.3 g cm", critical_speed="100 rad/s", speed="200 rad/s",
    ...     race_radius="12 mm", race_width="4 mm", balls=[6], runs=100,
    ... )
    >>> result.chosen.count, result.hold, result.runs.share.value > 0.9
    (6, None, True)
    >>> 2e3 * result.chosen.balls.radius < 4.0
    True
    """
    texts = SpecificationTexts(
        mass, critical_speed, speed, race_radius, race_width, unbalance, grade, damping_ratio,
        acceleration, settle, density, balls, share, residual, drag_tolerance, friction_arm,
    )  # fmt: skip
    running = Running(runs, seed, executor_of(workers, scheduler), progress)
    return run_sizing(specification_of(texts), running)
