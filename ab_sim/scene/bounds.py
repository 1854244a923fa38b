"""Bounds of a scene's numbers, to check arrays of values at once."""

import math
from collections.abc import Iterable, Iterator
from types import NoneType, UnionType
from typing import Annotated, Any, NamedTuple, Union, get_args, get_origin, get_type_hints

import numpy as np
from annotated_types import Ge, Gt, Le, Lt
from pydantic import BeforeValidator
from pydantic.fields import FieldInfo

from ab_sim.scene.model import Scene
from ab_sim.scene.quantities import Number
from ab_sim.scene.sections import Angle, Damping, Mass, Race, Rotor, Stiffness


class Bounds(NamedTuple):
    """Interval of allowed numbers: ``least`` and ``most`` included, ``above`` and ``below`` not."""

    least: float = -math.inf
    above: float = -math.inf
    most: float = math.inf
    below: float = math.inf

    @property
    def lowest(self) -> float:
        """Lower bound, whether or not the bound is itself an allowed value."""
        return max(self.least, self.above)

    @property
    def highest(self) -> float:
        """Upper bound, whether or not the bound is itself an allowed value."""
        return min(self.most, self.below)

    def hold(self, values: np.ndarray) -> np.ndarray:
        """Return a mask of the allowed values."""
        finite = np.isfinite(values) & (values >= self.least) & (values > self.above)
        return np.asarray(finite & (values <= self.most) & (values < self.below))


def bounds_at(scene: Scene, key: str) -> Bounds | None:
    """Return the bounds of the number at a dotted key, or of each number in a list at the key.

    Returns
    -------
    Bounds | None
        Bounds in SI units; None if the key has no number, or if the number has conditions other
        than bounds. Conditions between sections are not considered.
    """
    section, _, rest = key.partition(".")
    if section == "rotor" and rest in ("eccentricity", "total_mass", "mass", "eccentric_mass"):
        if getattr(scene.rotor, rest) is None:
            return None
        field = Rotor.model_fields[rest]
        return _bounds(field.annotation, field.metadata)
    if key == "balls.mass" and scene.balls.mass is not None:
        return _bounds(Mass)
    if key == "race.radius":
        field = Race.model_fields["radius"]
        return _bounds(field.annotation, field.metadata)
    if key == "start.ball_angles":
        return _bounds(Angle)
    if section == "mounts":
        return _OF_MOUNTS.get(rest.rpartition(".")[2])
    name, _, parameter = rest.partition(".")
    effect = scene.effects.get(name) if section == "effects" else None
    if effect is None or parameter not in effect._fields:
        return None
    if type(getattr(effect, parameter)) is not float:
        return None
    return _bounds(get_type_hints(type(effect), include_extras=True).get(parameter))


def _bounds(annotation: Any, more: Iterable[Any] = ()) -> Bounds | None:
    """Return the bounds in an annotation and in ``more`` metadata; None for other conditions."""
    limits: dict[str, float] = {}
    for constraint in (*_metadata(annotation), *more):
        match constraint:
            case Ge():
                limits["least"] = max(limits.get("least", -math.inf), float(constraint.ge))  # type: ignore[arg-type]
            case Gt():
                limits["above"] = max(limits.get("above", -math.inf), float(constraint.gt))  # type: ignore[arg-type]
            case Le():
                limits["most"] = min(limits.get("most", math.inf), float(constraint.le))  # type: ignore[arg-type]
            case Lt():
                limits["below"] = min(limits.get("below", math.inf), float(constraint.lt))  # type: ignore[arg-type]
            case _ if not _is_of_any_number(constraint):
                return None
    return Bounds(**limits)


def _metadata(annotation: Any) -> Iterator[Any]:
    """Yield the constraints on a float in an annotation.

    For another type, yield the type itself.
    """
    origin = get_origin(annotation)
    if origin is Annotated:
        inner, *metadata = get_args(annotation)
        yield from _metadata(inner)
        for entry in metadata:
            yield from entry.metadata if isinstance(entry, FieldInfo) else (entry,)
    elif origin in (Union, UnionType):
        others = [kind for kind in get_args(annotation) if kind is not NoneType]
        yield from _metadata(others[0]) if len(others) == 1 else (annotation,)
    elif annotation is not float:
        yield annotation


def _is_of_any_number(candidate: Any) -> bool:
    """Return whether a constraint applies to every number of a scene: to be finite, and no bool."""
    constraints = [*_metadata(Number)]
    if isinstance(candidate, BeforeValidator):
        return candidate in constraints
    return any(
        type(candidate) is type(constraint) and repr(candidate) == repr(constraint)
        for constraint in constraints
    )


_OF_MOUNTS = {"stiffness": _bounds(Stiffness), "damping": _bounds(Damping)}
