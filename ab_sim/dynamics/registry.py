"""The deck models that a scene can name: every file in ``deck_models/`` that registers one."""

import functools
import pkgutil
from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple, NoReturn

import numpy as np

from ab_sim.dynamics.linearised import Linearised
from ab_sim.dynamics.system import System
from ab_sim.errors import SceneError
from ab_sim.scene.model import Scene

PLANAR, IN_SPACE = "planar", "in_space"
"""Taken where a scene names none: without, and with a section ``deck``."""
_FOLDER = "ab_sim.dynamics.deck_models"


def _no_rates(system: System, top_speed: float) -> dict[str, complex]:
    return {}


def _not_known(system: System) -> NoReturn:
    name = type(system.deck_model).__name__
    raise SceneError(
        f"deck_model: {name} does not say how it moves by itself, which is asked for here; take "
        "deck_model out of the scene"
    )


class DeckFromScene(NamedTuple):
    """How a deck model follows from a scene, and what is known of its motion beforehand."""

    make: Callable[[Scene, tuple[object, ...]], Any]
    """The deck model, from a scene and its effects."""
    start: Callable[[Scene, System], np.ndarray]
    """Its states at t = 0."""
    yields: Callable[[System], list[np.ndarray]]
    """Acceleration of the race at each ball per force on it at each, along it [1/kg], each of shape
    (balls, balls), all balls side by side, in directions that matter: how much it lightens them."""
    rates: Callable[[System, float], dict[str, complex]] = _no_rates
    """Its fastest eigenvalues [1/s], up to a spindle speed, by what they belong to: steps are
    limited by them."""
    linearised: Callable[[System], Linearised] = _not_known
    """Small motions about where it hangs at rest: for modes."""
    own_motion: Callable[[System], np.ndarray] = _not_known
    """See ``dynamics.own_motion``: for ``collocation``, where the model has ``COORDINATES``."""
    spindle_inertia: Callable[[System], float] = _not_known
    """Of all that turns with the spindle, about the shaft [kg m^2]: the same."""


class RegisteredDeckModel(NamedTuple):
    """A deck model with how it is made."""

    kind: type[Any]
    """Decorated with ``equations.deck_model.deck_model``."""
    from_scene: DeckFromScene


_deck_models: dict[str, RegisteredDeckModel] = {}


def register_deck_model(name: str, kind: type[Any], from_scene: DeckFromScene) -> None:
    """Make a deck model known to scenes, in this process.

    Raises:
        ValueError: the name is taken, or the class has another one.
    """
    if name in _deck_models:
        raise ValueError(f"deck model {name!r} is registered twice")
    for other, known in _deck_models.items():
        if known.kind is kind:
            raise ValueError(f"deck model {name!r}: its class is that of {other!r}")
    _deck_models[name] = RegisteredDeckModel(kind, from_scene)


def deck_models() -> dict[str, RegisteredDeckModel]:
    """Every deck model by name."""
    _import_all()
    return dict(sorted(_deck_models.items()))


def of_scene(scene: Scene) -> DeckFromScene:
    """Of the deck model that a checked scene names, or has by its sections."""
    name = scene.deck_model or (PLANAR if scene.deck is None else IN_SPACE)
    _import_all()
    return _deck_models[name].from_scene


def of_system(system: System) -> DeckFromScene:
    """Of a system's deck model."""
    kind = type(system.deck_model)
    _import_all()
    return next(known.from_scene for known in _deck_models.values() if known.kind is kind)


def require_built_in(scene: Scene, asked: str) -> None:
    """Refuse a deck model of a program's own where formulas know only the built-in ones.

    Args:
        scene: as it was checked.
        asked: what uses these formulas, for the message.

    Raises:
        SceneError: names the key, its value, what is allowed and what to do.
    """
    name = scene.deck_model
    if name in (None, PLANAR, IN_SPACE):
        return
    raise SceneError(
        f"deck_model = {name!r}: {asked} needs the equations of a built-in deck model; "
        f"allowed here: {IN_SPACE}, {PLANAR}; take deck_model out of the scene (--set "
        "deck_model=), or simulate this deck instead, without faults of balls, mounts and disc"
    )


@functools.cache
def _import_all() -> None:
    folder = import_module(_FOLDER)
    for found in pkgutil.iter_modules(folder.__path__):
        import_module(f"{_FOLDER}.{found.name}")
