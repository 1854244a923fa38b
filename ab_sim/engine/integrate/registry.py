"""Registry of the steppers that a scene can name; each file in ``steppers/`` registers one."""

import functools
import pkgutil
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any, NamedTuple

from ab_sim.base.errors import SceneError, exact, nearest
from ab_sim.base.plug_ins import load_installed
from ab_sim.engine.integrate.stepper import Stepper

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
        """Meaning, with the unit if there is one."""
        return self.meaning if self.unit == "1" else f"{self.meaning} [{self.unit}]"


class _Family(NamedTuple):
    make: Callable[..., Stepper]
    parameters: Mapping[str, Parameter]


_families: dict[str, _Family] = {}


def register(stepper: Stepper) -> Stepper:
    """Register a stepper under its name, and return it."""
    register_family(stepper.name, {})(lambda: stepper)
    return stepper


def register_family(
    name: str, parameters: Mapping[str, Parameter]
) -> Callable[[Callable[..., Stepper]], Callable[..., Stepper]]:
    """Return a decorator that registers a function from parameters to steppers of this name.

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
    """Return every stepper by name, with its parameters' defaults."""
    return {name: stepper_named(name) for name in _known()}


def parameters_of(name: str) -> Mapping[str, Parameter]:
    """Return the parameters of the stepper of a name.

    Raises:
        SceneError: there is no such stepper, see ``stepper_named``.
    """
    return _family(name).parameters


def stepper_named(name: str, parameters: Mapping[str, Any] | None = None) -> Stepper:
    """Return the stepper of a name, the same object for the same parameters.

    Args:
        name: name of the stepper in scenes.
        parameters: values by parameter's name; others have their defaults.

    Raises:
        SceneError: the stepper is unknown (the message lists all and the nearest), it has no such
            parameter, or the parameter's value is not allowed.
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
    families = _known()
    if name in families:
        return families[name]
    raise SceneError(
        f"solver.stepper = {name!r}: no such stepper{nearest(name, [*families, AUTO])}; known are: "
        + ", ".join([*families, AUTO])
    )


@functools.cache
def _import_all() -> None:
    folder = import_module(_FOLDER)
    for module_info in pkgutil.iter_modules(folder.__path__):
        import_module(f"{_FOLDER}.{module_info.name}")
    load_installed()


def _known() -> dict[str, _Family]:
    _import_all()
    # Sorted by name, as the order of registration depends on earlier imports.
    return dict(sorted(_families.items()))
