"""From a scene that asks for an accuracy to one with a stepper and a step."""

import time

from ab_sim.accuracy.deviation import Samples
from ab_sim.accuracy.search import cheapest
from ab_sim.accuracy.trials import Tell, Timed
from ab_sim.accuracy.work_precision import WorkPrecision
from ab_sim.drive import Drive
from ab_sim.scene.model import Scene


def resolve_accuracy(
    scene: Scene,
    period: float | None = None,
    commanded: bool = False,
    tell: Tell | None = None,
) -> tuple[Scene, WorkPrecision | None]:
    """The scene with a solver: where it asks for an accuracy, the cheapest that delivers it.

    That is measured on the scene's own run, from its start over its profile and duration, which
    may take minutes; the commands that a live drive may get instead are not known, and nothing of
    the profile is decided while it runs: see ``Scene.planned``.

    Args:
        scene: a scene; if it asks for no accuracy it is returned as it is, with no price.
        period: s; the step goes into it a whole number of times.
        commanded: whether the step has to be stable up to ``spindle.max_speed``.
        tell: called before each run with the setting, and CPU time spent and allowed [s].

    Raises:
        SceneError: what is asked for cannot be had; says what can.
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
