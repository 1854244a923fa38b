"""Choose the stepper of a scene, and explain the choice."""

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
    """Stepper of a scene, with the reason for the choice and the longest stable step."""

    stepper: Stepper
    reason: str
    longest: float
    """Longest stable step [s]; infinite if nothing limits it."""
    limited_by: str
    """Name of the motion that limits the step; empty if none does."""
    cycle: float
    """Period of the fastest motion that the steps must follow [s]: the deck's whirl or the motor's
    loop. The decay of a ball's speed by drag may be faster, but it dies away."""


USUAL = "rk8"
"""Default stepper of ``auto``; ``accuracy:`` may find another one cheaper."""


def solving_drag(system: System) -> Stepper | None:
    """Return the stepper that is stable for any amount of the race's drag.

    Returns:
        The stepper, or None if it needs the deck's own motion and the deck model does not state it.
    """
    known = type(system.deck_model).COORDINATES
    able = (stepper for stepper in steppers().values() if stepper.solves_drag)
    return next((each for each in able if known or not each.needs_own_motion), None)


def _outlasting(system: System, step: float, rates: Mapping[str, complex]) -> Stepper | None:
    """Return the stepper of ``solving_drag`` if all other motions leave it stable at this step."""
    other = solving_drag(system)
    stable = other is not None and step <= largest_step(other, limiting(other, rates))[0]
    return other if stable else None


def limiting(stepper: Stepper, rates: Mapping[str, complex]) -> dict[str, complex]:
    """Return those of ``linear_rates`` that limit a stepper's step."""
    return {what: rate for what, rate in rates.items() if what != DRAG or not stepper.solves_drag}


def top_speed(scene: Scene, commanded: bool = False) -> float:
    """Return the largest speed of the spindle [rad/s], at which steps have to be stable.

    Args:
        scene: scene to run.
        commanded: True if the run takes commands, which may go up to ``spindle.max_speed``. Else
            the profile gives the largest speed. With a motor it is ``spindle.max_speed``, too, as
            the speed need not follow the profile.
    """
    if commanded or "motor" in scene.effects:
        return scene.spindle.max_speed
    return top_speed_of(scene)


def check_parts(
    stepper: Stepper, step: float, system: System, rates: Mapping[str, complex]
) -> None:
    """Refuse a step that is too long for the stepper that takes over steps with events.

    Raises:
        SceneError: the step is too long; the message names the limit and its cause.
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
    """Return the stepper that a scene names, or a suitable one for ``auto``.

    ``auto`` takes ``rk8`` if it is stable at the scene's step. If not, it takes a stepper that
    solves drag exactly, provided that the step samples each revolution at least once.

    Args:
        scene: scene to run.
        system: system of the scene.
        fastest: spindle speed [rad/s] up to which the step has to be stable; default: the
            ``top_speed`` of the scene's profile.

    Raises:
        SceneError: unknown stepper, step beyond its stability limit, parameters without a named
            stepper, or the scene requests an accuracy instead.
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
    # Do not switch the stepper automatically below one sample per revolution.
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
    # Without any motion of its own and with the spindle at rest, the system has no period.
    cycle = 2.0 * math.pi / fastest_rate if fastest_rate else step
    return Choice(stepper, reason, longest, what, cycle)


def _check_no_parameters_of_auto(solver: Solver) -> None:
    """Refuse parameters for ``auto``, as they belong to one stepper, which has to be named."""
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
    """Refuse a stepper that cannot stop at this system's events, or needs an unknown own motion."""
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
