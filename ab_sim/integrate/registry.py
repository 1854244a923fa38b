"""The steppers that a scene can name: every file in ``steppers/`` that registers one."""

import functools
import pkgutil
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any, NamedTuple

from ab_sim.errors import SceneError, exact, nearest
from ab_sim.integrate.stepper import Stepper

AUTO = "auto"
"""What a scene names to leave the choice open."""
_FOLDER = "ab_sim.integrate.steppers"


class Parameter(NamedTuple):
    """A number that a scene may give a stepper."""

    meaning: str
    default: float
    lowest: float
    highest: float
    unit: str = "1"
    values: tuple[float, ...] = ()
    """The only ones that it may have; empty: all from ``lowest`` to ``highest``."""

    @property
    def what(self) -> str:
        """Its meaning, with the unit, if it has one."""
        return self.meaning if self.unit == "1" else f"{self.meaning} [{self.unit}]"


class _Family(NamedTuple):
    make: Callable[..., Stepper]
    parameters: Mapping[str, Parameter]


_families: dict[str, _Family] = {}


def register(stepper: Stepper) -> Stepper:
    """Make a stepper known under its name; returns it."""
    register_family(stepper.name, {})(lambda: stepper)
    return stepper


def register_family(
    name: str, parameters: Mapping[str, Parameter]
) -> Callable[[Callable[..., Stepper]], Callable[..., Stepper]]:
    """Decorator: make a function known that makes steppers of this name from parameters.

    Raises:
        ValueError: the name is taken.
    """

    def add(make: Callable[..., Stepper]) -> Callable[..., Stepper]:
        if name in _families or name == AUTO:
            raise ValueError(f"stepper {name!r} is registered twice")
        _families[name] = _Family(functools.cache(make), parameters)
        return make

    return add


def steppers() -> dict[str, Stepper]:
    """Every stepper by name, with its parameters' defaults."""
    return {name: stepper_named(name) for name in _known()}


def parameters_of(name: str) -> Mapping[str, Parameter]:
    """What a scene may tell the stepper of that name.

    Raises:
        SceneError: see ``stepper_named``.
    """
    return _family(name).parameters


def stepper_named(name: str, parameters: Mapping[str, Any] | None = None) -> Stepper:
    """The stepper of that name; the same object for the same parameters.

    Args:
        name: what scenes call it.
        parameters: by name; what is left out has its default.

    Raises:
        SceneError: unknown; names the known ones and the nearest. Or it has no such parameter, or
            not with such a value.
    """
    family, given = _family(name), dict(parameters or {})
    for key, value in given.items():
        if key not in family.parameters:
            takes = ", ".join(family.parameters) or "none"
            raise SceneError(
                f"solver.parameters.{key}: {name} has no such parameter"
                f"{nearest(key, [*family.parameters])}; it takes: {takes}"
            )
        _check(key, value, family.parameters[key])
    defaults = {key: parameter.default for key, parameter in family.parameters.items()}
    return family.make(**(defaults | {key: float(value) for key, value in given.items()}))


def _check(key: str, value: float, parameter: Parameter) -> None:
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
    known = _known()
    if name in known:
        return known[name]
    raise SceneError(
        f"solver.stepper = {name!r}: no such stepper{nearest(name, [*known, AUTO])}; known are: "
        + ", ".join([*known, AUTO])
    )


@functools.cache
def _import_all() -> None:
    folder = import_module(_FOLDER)
    for found in pkgutil.iter_modules(folder.__path__):
        import_module(f"{_FOLDER}.{found.name}")


def _known() -> dict[str, _Family]:
    _import_all()
    # By name: whoever imports a stepper before registers it before.
    return dict(sorted(_families.items()))
