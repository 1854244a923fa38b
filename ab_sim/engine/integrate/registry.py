"""Steppers: description of their abilities, and registry of those that a scene can name.

Code that chooses, prices or runs steppers queries abilities by name, never a class. The files in
``steppers/`` register a ``Stepper``, or a function that creates one.
"""

import dataclasses
import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from ab_sim.base.errors import SceneError, exact, nearest
from ab_sim.base.named_entries import NamedEntries
from ab_sim.base.plug_ins import load_folder


@dataclass(frozen=True, eq=False)
class Stepper:
    """Named method for steps of a fixed length, with its declared order and abilities."""

    name: str
    order: int
    source: str
    weights: Any
    """NamedTuple of the method's numbers: a ``Tableau``, from which a step is emitted for each
    scene, or the input of the method's own code in the subset of ``ab_sim.engine.compiling``."""
    evaluations: int
    """Evaluations of the right-hand side per step."""
    growth: Callable[[Any], Any]
    """Stability function of a number or an array: factor by which one step, or one part of it,
    multiplies y for y' = lambda y, as a function of z = its length times lambda. With
    ``solves_drag``, lambda is the rate of any motion except drag."""
    memory: int = 0
    """Rows of numbers carried from one step to the next, which belong to the state. Zeros restart
    the method; they are set to zero where the motion has a kink."""
    parts: int = 1
    """Number of parts into which the method divides a step of the scene; for ``taylor`` the
    maximum."""
    solves_drag: bool = False
    """True if the method is stable for any amount of the race's drag."""
    takes_lanes: bool = False
    """True if several runs can take steps of this method together, one run per SIMD lane."""
    locates_events: bool = True
    """True if steps of this method can be cut at events, as set-valued laws need."""
    priced: bool = True
    """True if the method is tried when a scene requests an accuracy."""
    keeps_tolerance: bool = False
    """True if the error depends on the parameter ``tolerance`` and not on the step."""

    def in_parts(self, parts: int) -> "Stepper":
        """Return this method with each step of the scene divided into equal parts."""
        return self if parts == 1 else _divided(self, parts)


@functools.cache
def _divided(stepper: Stepper, parts: int) -> Stepper:
    return dataclasses.replace(stepper, parts=parts)


AUTO = "auto"
"""Name of the automatic choice."""
_FOLDER = "ab_sim.engine.integrate.steppers"


class Parameter(NamedTuple):
    """Number that a scene may pass to a stepper."""

    meaning: str
    default: float
    lowest: float
    highest: float
    unit: str = "1"
    values: tuple[float, ...] = ()
    """Allowed values; if empty, all from ``lowest`` to ``highest``."""

    @property
    def what(self) -> str:
        """Meaning of the parameter, followed by the unit if there is one."""
        return self.meaning if self.unit == "1" else f"{self.meaning} [{self.unit}]"


class _Family(NamedTuple):
    """Registered function that makes a stepper, and the parameters that the function takes."""

    make: Callable[..., Stepper]
    parameters: Mapping[str, Parameter]


FAMILIES = NamedEntries[_Family]("stepper")
"""Registered steppers; ``steppers`` registers those of the package and of plug-ins first."""


def register(stepper: Stepper) -> Stepper:
    """Register a stepper without parameters under ``stepper.name``; return the stepper."""
    register_family(stepper.name, {})(lambda: stepper)
    return stepper


def register_family(
    name: str, parameters: Mapping[str, Parameter]
) -> Callable[[Callable[..., Stepper]], Callable[..., Stepper]]:
    """Return a decorator that registers, as ``name``, a function from parameters to a stepper.

    Raises
    ------
    ValueError
        The name is taken, or is ``auto``.
    """

    def add(make: Callable[..., Stepper]) -> Callable[..., Stepper]:
        if name == AUTO:
            raise ValueError(f"stepper {name!r}: the name is reserved for the automatic choice")
        FAMILIES.add(name, _Family(functools.cache(make), parameters))
        return make

    return add


def steppers() -> dict[str, Stepper]:
    """Return all registered steppers by name; parameters have their defaults."""
    return {name: stepper_named(name) for name in _all_families()}


def parameters_of(name: str) -> Mapping[str, Parameter]:
    """Return the parameters of the stepper of a name.

    Raises
    ------
    SceneError
        There is no such stepper, see ``stepper_named``.
    """
    return _family(name).parameters


def stepper_named(name: str, parameters: Mapping[str, Any] | None = None) -> Stepper:
    """Return the stepper with a name; equal parameters give the same object.

    Parameters
    ----------
    name
        Name of the stepper in scenes.
    parameters
        Values by parameter's name; others have their defaults.

    Raises
    ------
    SceneError
        The stepper is unknown (the message lists all and the nearest), it has no such parameter, or
        the parameter's value is not allowed.
    """
    family, values = _family(name), dict(parameters or {})
    for key, value in values.items():
        if key not in family.parameters:
            takes = ", ".join(family.parameters) or "none"
            raise SceneError(
                f"solver.parameters.{key}: {name} has no such parameter"
                f"{nearest(key, [*family.parameters])}; it takes: {takes}"
            )
        _check(key, value, family.parameters[key])
    defaults = {key: parameter.default for key, parameter in family.parameters.items()}
    return family.make(**(defaults | {key: float(value) for key, value in values.items()}))


def _check(key: str, value: float, parameter: Parameter) -> None:
    """Refuse a value that a parameter does not allow."""
    lowest, highest = parameter.lowest, parameter.highest
    if parameter.values:
        if value in parameter.values:
            return
        *others, last = map(exact, parameter.values)
        allowed = f"{', '.join(others)} or {last}"
    elif lowest <= value <= highest:
        return
    else:
        allowed = f"within {exact(lowest)} to {exact(highest)}"
    raise SceneError(
        f"solver.parameters.{key} = {exact(value)}: must be {allowed}; {parameter.what}"
    )


def _family(name: str) -> _Family:
    """Return the family of a name; raise SceneError if there is none."""
    families = _all_families()
    if name in families:
        return families[name]
    raise SceneError(
        f"solver.stepper = {name!r}: no such stepper{nearest(name, [*families, AUTO])}; known are: "
        + ", ".join([*families, AUTO])
    )


def _all_families() -> dict[str, _Family]:
    """Return all registered families by name, those of plug-ins included."""
    load_folder(_FOLDER)
    # Sorted by name, as the order of registration depends on earlier imports.
    return dict(sorted(FAMILIES.items()))
