"""Numbers of a scene by their dotted keys: value and unit, and the scene with another value.

Entries of lists are counted from 0: ``balls.mass.1``, ``mounts.0.stiffness.2``. If a scene has one
number for all entries, each entry is this number, and changing an entry makes a list.
"""

import functools
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from ab_sim.base.errors import InputError, SceneError, nearest, short
from ab_sim.model.equations.neighbours import start_angles
from ab_sim.scene.changes import value_at
from ab_sim.scene.keys import SceneKey, key_starts_with, scene_keys
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene
from ab_sim.scene.registry import effect_classes

MOVING = ("rotor", "deck", "mounts", "race", "balls", "effects", "start", "profile")
"""Sections whose numbers act on the motion."""

ANGLES = "start.ball_angles"
IN_SPACE = ("rotor.height", "race.height")
"""Keys without a meaning for a deck that moves in the plane of the disc."""
MOTOR_INTEGRAL = "start.motor_integral"
"""Key without a meaning in a scene without a motor."""


class RealKey(NamedTuple):
    """Number of a scene, with its key and unit."""

    key: str
    value: float
    unit: str
    """SI unit; "1" for a number without dimension."""


def real_key(scene: Scene, key: str) -> RealKey:
    """Return a number of a scene by its key.

    Raises:
        InputError: the key does not exist, is a list or not a real number, or does not act on the
            motion; the message lists the keys.
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
    raw = _plain(scene)
    try:
        value = value_at(raw, key)
    except SceneError:  # a list has no such entry
        raise _unknown(scene, key) from None
    if isinstance(value, list) and value and isinstance(value[0], float):
        raise InputError(f"key {short(key)}: has {len(value)} numbers; name one, e.g. {key}.0")
    above = key.rpartition(".")[0]
    if value is None and above and (_row(parts) is None or value_at(raw, above) is None):
        raise _unknown(scene, key)
    if type(value) is not float:
        what = "is not given in this scene" if value is None else "is not a real number"
        raise InputError(f"key {short(key)}: {what}{_near(scene, key)}")
    return RealKey(key, value, _unit(parts))


def real_keys(scene: Scene) -> list[RealKey]:
    """Return all numbers of a scene that act on its motion and may change by themselves.

    A number for all balls or all axes is included once; lists are included entry by entry.
    """
    raw = scene.with_plain(MOVING)
    keys = [
        RealKey(key, value, _unit(key.split(".")))
        for section in MOVING
        for key, value in _inside(section, raw.get(section))
        if (scene.deck is not None or key not in IN_SPACE)
        and (key != MOTOR_INTEGRAL or "motor" in scene.effects)
    ]
    if scene.start.ball_angles is None:
        angles = enumerate(start_angles(scene))
        keys += [RealKey(f"{ANGLES}.{i}", angle, "rad") for i, angle in angles]
    return keys


def checked_keys(scene: Scene, keys: Sequence[str]) -> list[RealKey]:
    """Return values of a scene by their keys.

    Raises:
        InputError: ``keys`` is not a list or is empty, or a key is invalid, see ``real_key``.
    """
    if isinstance(keys, str) or not keys:
        raise InputError(f"keys = {keys!r}: must be a list of the scene's keys, at least one")
    return [real_key(scene, key) for key in keys]


def moved(scene: Scene, key: str, value: float) -> Scene:
    """Return the scene with another value of a key.

    Raises:
        SceneError: the value is not allowed.
    """
    return moved_together(scene, {key: value})


def moved_together(scene: Scene, values: Mapping[str, float]) -> Scene:
    """Return the scene with other values; see ``moved``."""
    changes: dict[str, object] = dict(values)
    if scene.start.ball_angles is None and any(key.startswith(ANGLES) for key in values):
        changes = {ANGLES: list(start_angles(scene)), **values}
    return changed_scene(scene, changes, scene.name)


def _plain(scene: Scene) -> dict[str, Any]:
    """Return the sections that act on the motion as plain values, with the balls' start angles."""
    raw: dict[str, Any] = scene.with_plain(MOVING)
    if scene.start.ball_angles is None and scene.balls.count:
        raw["start"]["ball_angles"] = list(start_angles(scene))
    return raw


def _inside(key: str, value: Any) -> Iterator[tuple[str, float]]:
    if type(value) is float:
        yield key, value
    elif isinstance(value, dict | list):
        for name, inner in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _inside(f"{key}.{name}", inner)


def _unit(parts: Sequence[str]) -> str:
    """Return the unit of a key; an entry of a list has that of the list."""
    row = _row(parts) or _row(parts[:-1])
    return "1" if row is None or row.unit == "-" else row.unit


def _row(parts: Sequence[str]) -> SceneKey | None:
    rows = (
        row for row in _rows(tuple(effect_classes())) if key_starts_with(row.key.split("."), parts)
    )
    return next((row for row in rows if row.key.count(".") == len(parts) - 1), None)


@functools.lru_cache(maxsize=1)
def _rows(effects: tuple[str, ...]) -> list[SceneKey]:
    """Return all keys, cached for a set of effects because reading the schema takes long."""
    return scene_keys()


def _unknown(scene: Scene, key: str) -> InputError:
    return InputError(f"key {short(key)}: this scene has no such number{_near(scene, key)}")


def _near(scene: Scene, key: str) -> str:
    all_keys = [real.key for real in real_keys(scene)]
    return f"{nearest(key, all_keys)}; it has {', '.join(all_keys)}"


def scale_of(real: RealKey) -> float:
    """Return a large change of a number: 1 rad for angles, else its size, or ``ZERO`` for 0."""
    if real.unit == "rad":
        return 1.0
    return abs(real.value) or ZERO.get(real.unit, 0.1)


ZERO = {"m": 1e-4, "kg": 1e-4, "kg m^2": 1e-7, "N m s/rad": 1e-4}
"""Large changes of numbers that are 0, by unit."""
