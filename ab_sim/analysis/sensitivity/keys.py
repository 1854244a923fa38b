"""Numbers of a scene by their dotted keys: what each is, and the scene with another value.

Entries of lists are counted from 0: ``balls.mass.1``, ``mounts.0.stiffness.2``. Where one number
stands for all, an entry is that number, and changing it makes a list.
"""

import functools
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from pydantic import BaseModel

from ab_sim.equations.neighbours import start_angles
from ab_sim.errors import InputError, SceneError, nearest
from ab_sim.quoting import short
from ab_sim.scene.changes import listed
from ab_sim.scene.keys import SceneKey, begins, scene_keys
from ab_sim.scene.model import Scene
from ab_sim.scene.registry import effect_classes

MOVING = ("rotor", "deck", "mounts", "race", "balls", "effects", "start", "profile")
"""Sections whose numbers act on the motion."""


IN_SPACE = ("rotor.height", "race.height")
"""Have no meaning for a deck that moves in the plane of the disc."""


class NoDerivative(SceneError):
    """A run has no derivative: says why.

    Args:
        text: for people.
        key: by which it has none; None: by any.
    """

    def __init__(self, text: str, key: str | None) -> None:
        super().__init__(text)
        self.key = key


class RealKey(NamedTuple):
    """A number of a scene."""

    key: str
    value: float
    unit: str
    """SI; "1" of a number without dimension."""


def real_key(scene: Scene, key: str) -> RealKey:
    """A number of a scene by its key.

    Raises:
        InputError: there is none; it is a list, or no real number; or it does not act on the
            motion. Names what there is.
    """
    parts = key.split(".")
    section = parts[0]
    if section not in MOVING:
        if section in type(scene).model_fields:
            raise InputError(
                f"key {short(key)}: {section} does not act on the motion, or has no derivative; "
                f"take a key of one of: {', '.join(MOVING)}"
            )
        raise _unknown(scene, key)
    try:
        value = _value(scene, parts, scene)
    except (AttributeError, KeyError, IndexError, TypeError, ValueError):
        raise _unknown(scene, key) from None
    if isinstance(value, tuple) and value and isinstance(value[0], float):
        raise InputError(f"key {short(key)}: has {len(value)} numbers; name one, e.g. {key}.0")
    if type(value) is not float:
        what = "is not given in this scene" if value is None else "is no real number"
        raise InputError(f"key {short(key)}: {what}{_near(scene, key)}")
    return RealKey(key, value, _unit(parts))


def real_keys(scene: Scene) -> list[RealKey]:
    """All numbers of a scene that act on its motion and may change by themselves.

    One that stands for all balls, or all axes, is there as such; of lists there is each entry.
    """
    found = [RealKey(key, value, _unit(key.split("."))) for key, value in _numbers(scene)]
    angles = scene.start.ball_angles is None and scene.balls.count
    if angles:
        at = start_angles(scene)
        found += [RealKey(f"start.ball_angles.{i}", x, "rad") for i, x in enumerate(at)]
    return found


def moved(scene: Scene, key: str, value: float) -> Scene:
    """The scene with another value, which is not checked: for differences only."""
    found: Scene = _replaced(scene, key.split("."), value, scene)
    return found


def _numbers(scene: Scene) -> Iterator[tuple[str, float]]:
    for section in MOVING:
        for key, value in _inside(section, getattr(scene, section)):
            if scene.deck is not None or key not in IN_SPACE:
                yield key, value


def _inside(key: str, value: Any) -> Iterator[tuple[str, float]]:
    if type(value) is float:
        yield key, value
        return
    named: Sequence[tuple[Any, Any]] = ()
    if isinstance(value, BaseModel):
        named = [(name, getattr(value, name)) for name in type(value).model_fields]
    elif isinstance(value, dict):
        named = list(value.items())
    elif hasattr(value, "_fields"):
        named = list(zip(value._fields, value, strict=True))
    elif isinstance(value, tuple):
        named = list(enumerate(value))
    for name, inner in named:
        yield from _inside(f"{key}.{name}", inner)


def _value(node: Any, parts: Sequence[str], scene: Scene, path: str = "") -> Any:
    if not parts:
        return node
    name, *rest = parts
    node = _listed(node, path, scene)
    path = f"{path}.{name}".lstrip(".")
    return _value(_child(node, name), rest, scene, path)


def _child(node: Any, name: str) -> Any:
    if isinstance(node, dict):
        return node[name]
    if isinstance(node, BaseModel):
        if name not in type(node).model_fields:
            raise KeyError(name)
        return getattr(node, name)
    if hasattr(node, "_fields"):
        if name not in node._fields:
            raise KeyError(name)
        return getattr(node, name)
    if isinstance(node, tuple) and name.isdecimal():
        return node[int(name)]
    raise KeyError(name)


def _listed(node: Any, path: str, scene: Scene) -> Any:
    """Where one number stands for all, or none is given, the list of them."""
    if node is None and path == "start.ball_angles":
        return start_angles(scene)
    entries = listed(path, node, scene.balls.count)
    return tuple(entries) if isinstance(entries, list) else entries


def _replaced(node: Any, parts: Sequence[str], value: float, scene: Scene, path: str = "") -> Any:
    if not parts:
        return value
    name, *rest = parts
    node = _listed(node, path, scene)
    inner = _replaced(_child(node, name), rest, value, scene, f"{path}.{name}".lstrip("."))
    if isinstance(node, dict):
        return {**node, name: inner}
    if isinstance(node, BaseModel):
        return node.model_copy(update={name: inner})
    if hasattr(node, "_fields"):
        return node._replace(**{name: inner})
    return (*node[: int(name)], inner, *node[int(name) + 1 :])


def _unit(parts: Sequence[str]) -> str:
    """By the scene's keys; an entry of a list has that of the list."""
    row = _row(parts) or _row(parts[:-1])
    return "1" if row is None or row.unit == "-" else row.unit


def _row(parts: Sequence[str]) -> SceneKey | None:
    rows = (row for row in _rows(tuple(effect_classes())) if begins(row.key.split("."), parts))
    return next((row for row in rows if row.key.count(".") == len(parts) - 1), None)


@functools.lru_cache(maxsize=1)
def _rows(effects: tuple[str, ...]) -> list[SceneKey]:
    """All keys while these effects are known; reading them from the schema takes long."""
    return scene_keys()


def _unknown(scene: Scene, key: str) -> InputError:
    return InputError(f"key {short(key)}: this scene has no such number{_near(scene, key)}")


def _near(scene: Scene, key: str) -> str:
    known = [real.key for real in real_keys(scene)]
    return f"{nearest(key, known)}; it has {', '.join(known)}"


def scale_of(real: RealKey) -> float:
    """How far a number is moved for a difference: far beside rounding, near beside what it does."""
    if real.unit == "rad":
        return 0.01
    return 0.01 * abs(real.value) if real.value else ZERO.get(real.unit, 1e-3)


ZERO = {"m": 1e-6, "kg": 1e-6, "kg m^2": 1e-9, "N m s/rad": 1e-6}
"""By unit, how far from 0."""
