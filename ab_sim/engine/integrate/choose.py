"""Longest stable step of a stepper; choice of the stepper of a scene, with its reason."""

import cmath
import functools
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ab_sim.base.errors import SceneError, exact, nearest
from ab_sim.engine.integrate.registry import AUTO, Stepper, parameters_of, stepper_named, steppers
from ab_sim.model.dynamics.assemble import DRAG, linear_rates
from ab_sim.model.dynamics.system import System, eventful, has_events
from ab_sim.model.spindle import top_speed_of
from ab_sim.scene.model import Scene
from ab_sim.scene.sections import Solver

_TOLERANCE = 1e-3
"""Growth per step that counts as stable, since methods amplify undamped motion slightly."""
_REACHES = np.concatenate([0.01 * np.arange(1, 5001), 50.0 * 2.0 ** np.arange(1, 31)])
"""Values of |z| at which growth is examined; a method stable at all of them has no limit."""


@functools.lru_cache(maxsize=1000)
def stability_limit(stepper: Stepper, direction: complex = -1.0) -> float:
    """Return the extent of a stepper's stability region from 0 in a direction.

    Parameters
    ----------
    stepper
        Method of integration.
    direction
        Complex number of modulus 1; -1 is the negative real axis, for decay, and +-1j the imaginary
        axis, for undamped motion.

    Returns
    -------
    float
        Largest x for which one step does not amplify y' = (x direction / step) y; infinite for a
        method that never amplifies it.
    """
    tolerance = 0.0 if direction == -1.0 else _TOLERANCE

    def unstable(x: Any) -> Any:
        return abs(stepper.growth(x * direction)) > 1.0 + tolerance

    # The first unstable point ends the interval of stability that begins at 0; bisection between
    # it and the last stable point gives the limit. Stable points beyond it do not count.
    with np.errstate(all="ignore"):  # far beyond the limit, powers overflow
        beyond = np.flatnonzero(unstable(_REACHES))
    if not len(beyond):
        return math.inf
    inside, outside = np.append(0.0, _REACHES)[beyond[0] : beyond[0] + 2].tolist()
    for _ in range(50):
        middle = 0.5 * (inside + outside)
        inside, outside = (inside, middle) if unstable(middle) else (middle, outside)
    return inside * stepper.parts


def largest_step(stepper: Stepper, rates: Mapping[str, complex]) -> tuple[float, str]:
    """Return the longest stable step [s], rounded down to three digits, and its cause.

    Parameters
    ----------
    stepper
        Method of integration.
    rates
        Eigenvalues [1/s] by the names of their motions; zeros do not limit the step.

    Returns
    -------
    tuple[float, str]
        The step and the name of the motion that limits it; infinity and an empty string if none
        does.
    """
    steps = {
        what: stability_limit(stepper, direction_of(rate)) / abs(rate)
        for what, rate in rates.items()
        if rate != 0
    }
    what = min(steps, key=lambda key: steps[key], default="")
    if math.isinf(steps.get(what, math.inf)):
        return math.inf, ""
    digits = 2 - math.floor(math.log10(steps[what]))
    return math.floor(steps[what] * 10.0**digits) / 10.0**digits, what


def check_step(
    stepper: Stepper, step: float, rates: Mapping[str, complex], limit: tuple[float, str]
) -> None:
    """Refuse a step that is beyond the stability limit.

    Parameters
    ----------
    stepper
        Method of integration.
    step
        Length of the step [s].
    rates
        Eigenvalues [1/s] by the names of their motions.
    limit
        ``largest_step`` of the method and these rates.

    Raises
    ------
    SceneError
        The step is too long; the message names the limit and its cause.
    """
    largest, what = limit
    if step <= largest:
        return
    advice = f"with {stepper.name} use at most {largest:g} s"
    if largest < 1e-8:
        advice = f"no {stepper.name} step of useful length is stable: lower the rate"
    raise SceneError(
        f"solver.step = {exact(step)} s: is beyond the stability limit of {what}, whose rate is "
        f"{abs(rates[what]):.4g} 1/s; {advice}"
    )


def direction_of(rate: complex) -> complex:
    """Return the direction of a rate, rounded so that the cache serves nearly equal directions."""
    return cmath.rect(1.0, round(cmath.phase(rate), 3)) if rate.imag else -1.0


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
"""Default stepper of ``auto``; for a requested accuracy, another one may be cheaper."""
STIFF = "imex8"
"""Stepper that ``auto`` takes if, because of drag, it needs fewer evaluations than ``USUAL``."""
_FEW_PARTS = 4
"""Number of parts of a step up to which the more accurate ``USUAL`` is preferred to ``STIFF``."""
_MOST_PARTS = 1024
"""Maximum number of parts of a step."""
FOLLOWED = 0.5
"""Largest product of a part's length and the rate of an oscillation that limits the step."""


def _automatic(step: float, speed: float, rates: Mapping[str, complex]) -> Stepper | None:
    """Return the stepper that is stable at this step with the least effort.

    Returns
    -------
    Stepper | None
        The stepper, which may divide the step into parts; None if no stepper is stable, or if the
        step would be divided although it samples a revolution less than once.
    """
    usual, stiff = (_in_stable_parts(stepper_named(name), step, rates) for name in (USUAL, STIFF))
    if usual.parts == 1:
        return usual
    if usual.parts <= _FEW_PARTS or _effort(usual) <= _effort(stiff):
        choice = usual
    else:
        choice = stiff
    return choice if choice.parts <= _MOST_PARTS and step * speed <= 2.0 * math.pi else None


def _in_stable_parts(stepper: Stepper, step: float, rates: Mapping[str, complex]) -> Stepper:
    """Return a stepper with as few parts of the step [s] as are stable at these rates [1/s]."""
    longest, what = largest_step(stepper, step_limiting_rates(stepper, rates))
    # A stable step suffices for a motion that decays, but an oscillation must be resolved.
    if step > longest and rates[what].imag:
        longest = min(longest, FOLLOWED / abs(rates[what]))
    return stepper.in_parts(max(1, math.ceil(step / longest)))


def _effort(stepper: Stepper) -> int:
    """Return the number of evaluations of the right-hand side per step."""
    return stepper.parts * stepper.evaluations


def step_limiting_rates(stepper: Stepper, rates: Mapping[str, complex]) -> dict[str, complex]:
    """Return the rates, from ``linear_rates``, that limit the step of a stepper."""
    return {what: rate for what, rate in rates.items() if what != DRAG or not stepper.solves_drag}


def top_speed(scene: Scene, commanded: bool = False) -> float:
    """Return the largest speed of the spindle [rad/s], up to which steps must be stable.

    With commands or a motor, it is ``spindle.max_speed``, because the speed may differ from the
    profile. Otherwise it is the largest speed of the profile.

    Parameters
    ----------
    scene
        Scene to run.
    commanded
        True if the run takes commands.
    """
    if commanded or "motor" in scene.effects:
        return scene.spindle.max_speed
    return top_speed_of(scene)


def choose_stepper(scene: Scene, system: System, fastest: float | None = None) -> Choice:
    """Return the stepper that a scene names, or a suitable one for ``auto``.

    ``auto`` takes ``rk8`` if it is stable at the scene's step. If not, it divides steps into equal
    parts: those of ``rk8``, or those of ``imex8`` if drag makes them cheaper. It does so only if
    the step samples each revolution at least once.

    Parameters
    ----------
    scene
        Scene to run.
    system
        System of the scene.
    fastest
        Spindle speed [rad/s] up to which the step must be stable; default: the ``top_speed`` of the
        scene's profile.

    Raises
    ------
    SceneError
        Unknown stepper, step beyond its stability limit, parameters without a named stepper, or the
        scene requests an accuracy instead.
    """
    if scene.accuracy is not None:
        raise SceneError(
            "accuracy: needs runs of the scene to choose a stepper and a step; "
            "ab_sim.resolve_accuracy(scene) does so, and returns the scene with them"
        )
    _check_no_parameters_of_auto(scene.solver)
    step, name = scene.solver.step, scene.solver.stepper
    speed = top_speed(scene) if fastest is None else fastest
    rates = linear_rates(system, speed)
    automatic = _automatic(step, speed, rates)
    if name != AUTO:
        stepper, reason = stepper_named(name, scene.solver.parameters), "named by the scene"
    else:
        stepper, reason = automatic or stepper_named(USUAL), "auto: stable at this step"
        most, what = largest_step(stepper_named(USUAL), rates)
        if step > most and automatic is not None:
            reason = (
                f"auto: {USUAL} would need steps of at most {most:g} s for {what}, whose rate is "
                f"{abs(rates[what]):.4g} 1/s"
            )
            if stepper.parts > 1:
                reason += f"; takes each step in {stepper.parts} parts"
    _check_suits(stepper, scene, system)
    limits = step_limiting_rates(stepper, rates)
    longest, what = largest_step(stepper, limits)
    try:
        check_step(stepper, step, limits, (longest, what))
    except SceneError as error:
        if automatic is None:
            raise
        raise SceneError(f"{error}; or leave solver.stepper to auto") from None
    other_rates = (rate for what, rate in rates.items() if what != DRAG)
    fastest_rate = max(map(abs, other_rates), default=0.0)
    # A system without a spring and with the spindle at rest has no period.
    cycle = 2.0 * math.pi / fastest_rate if fastest_rate else step
    return Choice(stepper, reason, longest, what, cycle)


def _check_no_parameters_of_auto(solver: Solver) -> None:
    """Refuse parameters for ``auto``, as they belong to one stepper, which must be named."""
    if solver.stepper != AUTO or not solver.parameters:
        return
    key, value = next(iter(solver.parameters.items()))
    takes = [name for name in steppers() if key in parameters_of(name)]
    all_parameters = sorted({key for name in steppers() for key in parameters_of(name)})
    name_it = (
        f"name the stepper that takes it ({' or '.join(takes)})"
        if takes
        else f"no stepper takes it{nearest(key, all_parameters)}"
    )
    raise SceneError(
        f"solver.parameters.{key} = {exact(value)}: solver.stepper is {AUTO!r}, which takes no "
        f"parameters; {name_it}, or remove solver.parameters (--set solver.parameters=)"
    )


def _check_suits(stepper: Stepper, scene: Scene, system: System) -> None:
    """Refuse a stepper whose steps cannot be cut at this system's events."""
    if has_events(system.effects) and not stepper.locates_events:
        able = ", ".join(name for name, stepper in steppers().items() if stepper.locates_events)
        because = ", ".join(f"{name} ({why})" for name, why in eventful(scene.effects).items())
        raise SceneError(
            f"solver.stepper = {stepper.name!r}: its steps cannot be cut at events, which come "
            f"with effects.{because}; name one of: {able}"
        )
