"""Resolution of a requested accuracy to a stepper and a step."""

import time

from ab_sim.base.presentation import Progress
from ab_sim.drive import Drive
from ab_sim.drive.accuracy.deviation import Samples
from ab_sim.drive.accuracy.search import cheapest
from ab_sim.drive.accuracy.trials import Timed
from ab_sim.drive.accuracy.work_precision import WorkPrecision
from ab_sim.scene.model import Scene


def resolve_accuracy(
    scene: Scene,
    period: float | None = None,
    commanded: bool = False,
    tell: Progress | None = None,
) -> tuple[Scene, WorkPrecision | None]:
    """Return the scene with the cheapest solver that delivers its requested accuracy.

    Errors are measured on the scene's own run, over its profile and duration, which may take
    minutes. Commands of a live drive are unknown, so they are not part of that run. A profile
    controlled during the run is replaced by its plan, see ``Scene.planned``.

    Args:
        scene: scene; without a requested accuracy it is returned unchanged, with None.
        period: period of a live node [s], which must be a multiple of the step; None for any step.
        commanded: whether the step must be stable up to ``spindle.max_speed``.
        tell: called before each run with the setting, and the CPU time spent and allowed [s].

    Returns:
        The scene with its solver, and the solver's measured error and cost.

    Raises:
        SceneError: the accuracy cannot be reached; the message states the best possible one.
        DivergedError: the scene's run diverges with every step.
    """
    if scene.accuracy is None:
        return scene, None
    return cheapest(scene, _timed_run, period, commanded, tell)


def _timed_run(scene: Scene, steps: int, every: int) -> Timed:
    drive = Drive(scene.planned)
    begin = time.thread_time()
    taken = drive.advance(steps, every)
    seconds = time.thread_time() - begin
    return Timed(Samples.of(taken), seconds)
