"""Comparison of a run with runs without balls and without a variable-speed period."""

from collections.abc import Callable

from ab_sim.analysis.compared import Compared, Comparison
from ab_sim.analysis.offline import OfflineRun, run_scene
from ab_sim.analysis.rest import from_rest
from ab_sim.base.errors import AbSimError
from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene


def compare_run(
    run: OfflineRun, progress: Callable[[Drive, Trajectory], None] | None = None
) -> Comparison:
    """Run again without the balls, and without the variable-speed period.

    Parameters
    ----------
    run : OfflineRun
        Run to compare with. The others have the same duration, stepper and step.
    progress : callable, optional
        Called with the drive and its newest samples, as each run advances.

    Returns
    -------
    Comparison
        ``without_balls`` (also without their mass) and ``without_period``: time [s], whirl [m],
        speed [rad/s], each of shape (samples,), and metrics. Instead, the error message of a run
        that failed, or None if the scene has nothing to leave out.

    Examples
    --------
    >>> import ab_sim
    >>> run = ab_sim.simulate(ab_sim.load_scene("thesis-hold", ["duration=0.2"]))
    >>> comparison = ab_sim.compare_run(run)
    >>> round(comparison.relative_whirl(run.metrics), 1)  # with balls / without balls
    3.1
    >>> picture = run.plot(comparison)  # what `ab-sim run --plot` draws
    """
    period = balls = None
    if run.variable_speed_period is not None:
        period = _beside(run, without_period, progress)
    if run.scene.balls.count:
        balls = _beside(run, without_balls, progress)
    return Comparison(period, balls)


def without_period(scene: Scene) -> Scene:
    """Return the scene with constant acceleration, without its variable-speed period."""
    what = "without variable-speed period"
    changes = {"name": f"{scene.name}, {what}", "profile.variable_speed_period": None}
    return changed_scene(scene, changes, what)


def without_balls(scene: Scene) -> Scene:
    """Return the scene without balls and their mass; the unbalance M0 e remains.

    An adaptive start-up is replaced by its plan, because its controller would wait for balls to
    move.
    """
    what = "without balls"
    changes = {
        "name": f"{scene.name}, {what}",
        "balls": {"count": 0},
        "start.ball_angles": [],
        "start.ball_rates": [],
        "rotor.mass": scene.total_mass - scene.balls.total_mass,
        "rotor.eccentric_mass": scene.eccentric_mass,
    }
    if scene.rotor.total_mass is not None:
        changes["rotor.total_mass"] = None
    return changed_scene(scene.planned, changes, what)


def _beside(
    run: OfflineRun,
    change: Callable[[Scene], Scene],
    progress: Callable[[Drive, Trajectory], None] | None,
) -> Compared | str:
    duration = float(run.trajectory["time"][-1])
    same = {"solver.stepper": run.stepper, "duration": duration}
    try:
        scene = changed_scene(change(run.scene), same, "compared run")
        other = run_scene(scene, progress=progress)
    except AbSimError as error:
        return str(error)
    path = from_rest(other.trajectory, other.scene)
    return Compared(other.metrics, path["time"].copy(), path.whirl, path["speed"].copy())
