"""Which stepper a scene is run with, and why."""

import math
from collections.abc import Mapping
from typing import NamedTuple

from ab_sim.dynamics.assemble import DRAG, linear_rates
from ab_sim.dynamics.system import System, eventful, has_events
from ab_sim.errors import SceneError, exact, nearest
from ab_sim.integrate.limits import check_step, largest_step
from ab_sim.integrate.registry import AUTO, parameters_of, stepper_named, steppers
from ab_sim.integrate.stepper import Stepper
from ab_sim.scene.model import Scene
from ab_sim.scene.sections import Solver
from ab_sim.spindle import top_speed_of


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


USUAL = "rk8"
"""What ``auto`` takes where nothing speaks against it; ``accuracy:`` may find another cheaper."""


def solving_drag(system: System) -> Stepper | None:
    """The stepper that any amount of the race's drag leaves stable.

    Returns:
        None where there is none, because it needs to know the own motion of what carries the balls.
    """
    known = type(system.deck_model).COORDINATES
    able = (stepper for stepper in steppers().values() if stepper.solves_drag)
    return next((each for each in able if known or not each.needs_own_motion), None)


def _outlasting(system: System, step: float, rates: Mapping[str, complex]) -> Stepper | None:
    """``solving_drag``'s stepper, if what else moves by itself leaves it stable at this step."""
    other = solving_drag(system)
    stable = other is not None and step <= largest_step(other, limiting(other, rates))[0]
    return other if stable else None


def limiting(stepper: Stepper, rates: Mapping[str, complex]) -> dict[str, complex]:
    """Those of ``linear_rates`` that limit a stepper's step."""
    return {what: rate for what, rate in rates.items() if what != DRAG or not stepper.solves_drag}


def top_speed(scene: Scene, commanded: bool = False) -> float:
    """The fastest that the spindle can go [rad/s], which steps have to be stable at.

    Args:
        scene: what is run.
        commanded: whether commands are taken, which go up to ``spindle.max_speed``; else its
            profile says how fast, but for a motor's, whose speed need not follow it.
    """
    if commanded or "motor" in scene.effects:
        return scene.spindle.max_speed
    return top_speed_of(scene)


def check_parts(
    stepper: Stepper, step: float, system: System, rates: Mapping[str, complex]
) -> None:
    """Refuse a step that is too long for the stepper which steps with events are handed over to.

    Raises:
        SceneError: names what limits it, and the largest allowed one.
    """
    other = stepper.over_events
    if other is None or not has_events(system.effects):
        return
    most, what = largest_step(other, rates)
    if step <= most * stepper.parts:
        return
    raise SceneError(
        f"solver.step = {exact(step)} s: {stepper.name} leaves steps with events to {other.name}, "
        f"which goes over them in at most {stepper.parts} parts, each stable up to {most:g} s "
        f"because of {what}, whose rate is {abs(rates[what]):.4g} 1/s; use at most "
        f"{most * stepper.parts:g} s"
    )


def choose_stepper(scene: Scene, system: System, fastest: float | None = None) -> Choice:
    """The stepper that a scene names, or the one that it calls for if it leaves that open.

    Args:
        scene: what is run.
        system: its system.
        fastest: spindle speed [rad/s] up to which the step has to be stable; default: the
            ``top_speed`` of the scene's profile.

    Raises:
        SceneError: unknown stepper, the step is beyond its stability limit, parameters without a
            stepper that is named, or the scene asks for an accuracy instead.
    """
    if scene.accuracy is not None:
        raise SceneError(
            "accuracy: has to be turned into a stepper and a step first, which takes runs of the "
            "scene: ab_sim.accuracy.resolve_accuracy(scene) returns the scene with them"
        )
    _check_no_parameters_of_auto(scene.solver)
    step, name = scene.solver.step, scene.solver.stepper
    speed = top_speed(scene) if fastest is None else fastest
    rates = linear_rates(system, speed)
    beside_drag = {what: rate for what, rate in rates.items() if what != DRAG}
    other = _outlasting(system, step, rates)
    # Where there is not a sample in each turn of the spindle, nobody helps unasked.
    unasked = other if step * speed <= 2.0 * math.pi else None
    if name != AUTO:
        stepper, reason = stepper_named(name, scene.solver.parameters), "named by the scene"
    else:
        stepper, reason = stepper_named(USUAL), "auto: stable at this step"
        most, what = largest_step(stepper, rates)
        if step > most and unasked is not None:
            stepper = unasked
            reason = (
                f"auto: {USUAL} would need steps of at most {most:g} s for {what}, whose rate is "
                f"{abs(rates[what]):.4g} 1/s"
            )
    _check_suits(stepper, scene, system)
    check_parts(stepper, step, system, rates)
    limits = limiting(stepper, rates)
    longest, what = largest_step(stepper, limits)
    try:
        check_step(stepper, step, limits, (longest, what))
    except SceneError as error:
        if other is None or (what != DRAG and unasked is None):
            raise
        try:
            check_parts(other, step, system, rates)
        except SceneError:
            raise error from None  # it would not help
        leave = "or leave solver.stepper to auto, " if unasked else ""
        way_out = f"{leave}or name {other.name}"
        raise SceneError(f"{error}; {way_out}") from None
    fastest_rate = max((abs(rate) for rate in beside_drag.values()), default=0.0)
    # Where nothing moves by itself, and the spindle stands, there is no cycle and no curve.
    cycle = 2.0 * math.pi / fastest_rate if fastest_rate else step
    return Choice(stepper, reason, longest, what, cycle)


def _check_no_parameters_of_auto(solver: Solver) -> None:
    """Refuse parameters for ``auto``: they belong to one stepper, which has to be named."""
    if solver.stepper != AUTO or not solver.parameters:
        return
    key, value = next(iter(solver.parameters.items()))
    takes = [name for name in steppers() if key in parameters_of(name)]
    known = sorted({key for name in steppers() for key in parameters_of(name)})
    name_it = (
        f"name the stepper that takes it ({' or '.join(takes)})"
        if takes
        else f"no stepper takes it{nearest(key, known)}"
    )
    raise SceneError(
        f"solver.parameters.{key} = {exact(value)}: solver.stepper is {AUTO!r}, which takes no "
        f"parameters; {name_it}, or remove solver.parameters (--set solver.parameters=)"
    )


def _check_suits(stepper: Stepper, scene: Scene, system: System) -> None:
    """Refuse a stepper that cannot be cut at this system's events, or lacks its own motion."""
    if has_events(system.effects) and not stepper.locates_events:
        able = ", ".join(name for name, known in steppers().items() if known.locates_events)
        because = ", ".join(f"{name} ({why})" for name, why in eventful(scene.effects).items())
        raise SceneError(
            f"solver.stepper = {stepper.name!r}: its steps cannot be cut at events, which come "
            f"with effects.{because}; name one of: {able}"
        )
    if stepper.needs_own_motion and not type(system.deck_model).COORDINATES:
        able = ", ".join(n for n, known in steppers().items() if not known.needs_own_motion)
        raise SceneError(
            f"solver.stepper = {stepper.name!r}: needs to know the own motion of what carries the "
            f"balls, and {type(system.deck_model).__name__} says nothing of it; name one of: {able}"
        )
