"""Check that a scene can be exported to C: smooth, with an explicit method of fixed step."""

import math
from collections.abc import Iterator
from typing import NamedTuple

from ab_sim.base.errors import SceneError, exact
from ab_sim.engine.integrate.choose import Choice, choose_stepper, step_limiting_rates, top_speed
from ab_sim.engine.integrate.limits import largest_step
from ab_sim.engine.integrate.registry import stepper_named
from ab_sim.engine.kernels.runge_kutta import Tableau
from ab_sim.model.dynamics.assemble import linear_rates, system_of
from ab_sim.model.dynamics.system import System, eventful
from ab_sim.model.spindle import SpeedSchedule
from ab_sim.scene.model import Scene


def suitable(scene: Scene) -> tuple[System, Choice]:
    """Return a scene's system and stepper, if it can be converted to C.

    Args:
        scene: scene to convert.

    Raises:
        SceneError: the scene has effects with events, probes, an accuracy, or a profile that
            depends on measurements (one message names all of these); or its method is not explicit;
            or its step is too long at ``spindle.max_speed``, the limit of commands.
    """
    refusals = list(_refusals(scene))
    if len(refusals) == 1:
        raise SceneError(refusals[0].why)
    if refusals:
        reasons = "; ".join(f"({n}) {refusal.why}" for n, refusal in enumerate(refusals, 1))
        options = " ".join(refusal.options for refusal in refusals)
        raise SceneError(f"{len(refusals)} reasons: {reasons}; without all of them: {options}")
    system = system_of(scene)
    choice = choose_stepper(scene, system, top_speed(scene))
    _check_explicit(scene, system, choice)
    try:
        _check_explicit(scene, system, choose_stepper(scene, system, scene.spindle.max_speed))
    except SceneError as error:
        raise SceneError(
            f"{error} (C takes commands up to spindle.max_speed = "
            f"{exact(scene.spindle.max_speed)} rad/s; lower that, or the step)"
        ) from None
    return system, choice


class _Refusal(NamedTuple):
    why: str
    """Reason of the refusal with a remedy."""
    options: str
    """Options of the command that remove the cause."""


def _refusals(scene: Scene) -> Iterator[_Refusal]:
    """Yield the refusals that do not need the scene's system."""
    if effects_with_events := eventful(scene.effects):
        named = ", ".join(f"{name} ({what})" for name, what in effects_with_events.items())
        leave_out = " ".join(f"--set effects.{name}=" for name in effects_with_events)
        yield _Refusal(
            f"effects: {named}: C has no location of events, which these need; leave them out "
            f"({leave_out}) if what you test does not depend on them, or run this scene by ab-sim "
            "(ab-sim live, ab_sim.Drive)",
            leave_out,
        )
    if scene.probes:
        yield _Refusal(
            f"probes: {', '.join(scene.probes)}: C has accelerometers only; leave them out (--set "
            "probes=), its outputs have the displacement itself",
            "--set probes=",
        )
    if scene.accuracy is not None:
        options = "--set accuracy= --set solver.stepper=rk8 --set solver.step=0.001"
        yield _Refusal(
            "accuracy: C takes steps of a fixed length by an explicit method; name them instead: "
            + options,
            options,
        )
    if scene.is_controlled:
        try:
            SpeedSchedule.of_scene(scene)
        except SceneError as error:
            yield _Refusal(str(error), "--set profile=")


def _check_explicit(scene: Scene, system: System, choice: Choice) -> None:
    if isinstance(choice.stepper.weights, Tableau):
        return
    usual = stepper_named("rk8")
    rates = step_limiting_rates(usual, linear_rates(system, scene.spindle.max_speed))
    longest, what = largest_step(usual, rates)
    # Rounded down to one digit.
    step = min(scene.solver.step, 10.0 ** math.floor(math.log10(min(longest, 1.0))))
    step *= max(1.0, math.floor(min(longest, scene.solver.step) / step))
    raise SceneError(
        f"solver.stepper = {scene.solver.stepper!r}: is {choice.stepper.name} here "
        f"({choice.reason}), and C takes steps of an explicit method; rk8 takes steps of at most "
        f"{longest:.3g} s because of {what}: --set solver.stepper=rk8 --set solver.step={step:g}"
    )
