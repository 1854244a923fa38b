"""Which stepper a scene is run with, and why."""

import math
from typing import NamedTuple

from ab_sim.dynamics.assemble import DRAG, linear_rates
from ab_sim.dynamics.system import System
from ab_sim.errors import SceneError
from ab_sim.integrate.limits import check_step, largest_step
from ab_sim.integrate.registry import AUTO, Stepper, stepper_named
from ab_sim.integrate.rk8 import RK8
from ab_sim.integrate.sweeps import SWEEPS, Sweeps
from ab_sim.scene.model import Scene
from ab_sim.spindle import SpeedProfile


class Choice(NamedTuple):
    """A stepper, why it was taken, and the longest step that it may take here."""

    stepper: Stepper
    reason: str
    longest: float
    """s; infinite where nothing limits the step."""
    limited_by: str
    cycle: float
    """Of the fastest motion that its steps follow [s]: the deck's whirl or the motor's loop. What
    the drag makes of a ball's speed is faster now and then, but dies away."""


def top_speed(scene: Scene, commanded: bool = False) -> float:
    """The fastest that the spindle can go [rad/s], which steps have to be stable at.

    Args:
        scene: what is run.
        commanded: whether commands are taken, which go up to ``spindle.max_speed``; else its
            profile says how fast, but for a motor's, whose speed need not follow it.
    """
    if commanded or "motor" in scene.effects:
        return scene.spindle.max_speed
    return SpeedProfile.of_scene(scene).top_speed


def choose_stepper(scene: Scene, system: System, fastest: float | None = None) -> Choice:
    """The stepper that a scene names, or the one that its drag calls for if it leaves that open.

    Args:
        scene: what is run.
        system: its system.
        fastest: spindle speed [rad/s] up to which the step has to be stable; default: the
            ``top_speed`` of the scene's profile.

    Raises:
        SceneError: unknown stepper, the step is beyond its stability limit, or the scene asks for
            an accuracy instead.
    """
    if scene.accuracy is not None:
        raise SceneError(
            "accuracy: has to be turned into a stepper and a step first, which takes runs of the "
            "scene: ab_sim.accuracy.resolve_accuracy(scene) returns the scene with them"
        )
    step, name = scene.solver.step, scene.solver.stepper
    rates = linear_rates(system, top_speed(scene) if fastest is None else fastest)
    beside_drag = {what: rate for what, rate in rates.items() if what != DRAG}
    if name != AUTO:
        stepper, reason = stepper_named(name), "named by the scene"
    else:
        most, what = largest_step(RK8, rates)
        stepper, reason = RK8, "auto: stable at this step"
        if step > most and what == DRAG:
            stepper = SWEEPS
            reason = (
                f"auto: rk8 would need steps of at most {most:g} s for {DRAG}, whose rate is "
                f"{abs(rates[DRAG]):.4g} 1/s"
            )
    limits = beside_drag if isinstance(stepper, Sweeps) else rates
    try:
        check_step(stepper, step, limits)
    except SceneError as error:
        if largest_step(stepper, limits)[1] == DRAG:
            raise SceneError(f"{error}; or leave solver.stepper to auto, or name sweeps") from None
        raise
    fastest_rate = max(abs(rate) for rate in beside_drag.values())
    # Where nothing moves by itself, and the spindle stands, there is no cycle and no curve.
    cycle = 2.0 * math.pi / fastest_rate if fastest_rate else step
    return Choice(stepper, reason, *largest_step(stepper, limits), cycle)
