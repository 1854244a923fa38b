"""Registry of the deck models that a scene can name, from the files in ``deck_models/``."""

from collections.abc import Callable
from typing import Any, NamedTuple, NoReturn

import numpy as np

from ab_sim.base.errors import SceneError
from ab_sim.base.named_entries import NamedEntries
from ab_sim.base.plug_ins import load_folder
from ab_sim.model.dynamics.at_rest import Linearised
from ab_sim.model.dynamics.system import System
from ab_sim.scene.model import Scene

PLANAR, IN_SPACE = "planar", "in_space"
"""Default deck models: without and with a section ``deck`` in the scene."""
_FOLDER = "ab_sim.model.dynamics.deck_models"


def _no_rates(system: System, top_speed: float) -> dict[str, complex]:
    return {}


def _not_known(system: System) -> NoReturn:
    name = type(system.deck_model).__name__
    raise SceneError(
        f"deck_model: {name} does not define its free motion, which is required here; remove "
        "deck_model from the scene"
    )


class DeckFromScene(NamedTuple):
    """Functions that make a deck model from a scene, and predict motion and rates of the deck."""

    make: Callable[[Scene, tuple[object, ...]], Any]
    """Function that returns the deck model of a scene with the given effects."""
    start: Callable[[Scene, System], np.ndarray]
    """Function that returns the deck model's states at t = 0."""
    yields: Callable[[System], list[np.ndarray]]
    """Function that returns matrices of shape (balls, balls), one for each relevant angle at which
    all balls are placed: accelerations of the race at each ball per force on the race at each ball
    [1/kg], both along the race. They show how much the deck reduces the balls' effective mass."""
    rates: Callable[[System, float], dict[str, complex]] = _no_rates
    """Function that returns the fastest eigenvalues [1/s] up to a spindle speed, by name; they
    limit the step."""
    linearised: Callable[[System], Linearised] = _not_known
    """Function that returns the linear equations of small motions about the position at rest."""


class RegisteredDeckModel(NamedTuple):
    """A registered deck model: its class, and its functions for scenes."""

    kind: type[Any]
    """Class decorated with ``equations.deck_model.deck_model``."""
    from_scene: DeckFromScene


DECK_MODELS = NamedEntries[RegisteredDeckModel]("deck model")
"""Registered deck models; ``deck_models`` registers those of the package and of plug-ins first."""


def register_deck_model(name: str, kind: type[Any], from_scene: DeckFromScene) -> None:
    """Register a deck model for scenes in this process.

    Raises
    ------
    ValueError
        The name is taken, or the class is registered under another name.
    """
    for other, deck_model in DECK_MODELS.items():
        if other != name and deck_model.kind is kind:
            raise ValueError(f"deck model {name!r}: its class is already registered as {other!r}")
    DECK_MODELS.add(name, RegisteredDeckModel(kind, from_scene))


def deck_models() -> dict[str, RegisteredDeckModel]:
    """Return all deck models by name."""
    load_folder(_FOLDER)
    return dict(sorted(DECK_MODELS.items()))


def of_scene(scene: Scene) -> DeckFromScene:
    """Return the functions for the deck model that a checked scene names, or has by default."""
    name = scene.deck_model or (PLANAR if scene.deck is None else IN_SPACE)
    load_folder(_FOLDER)
    return DECK_MODELS[name].from_scene


def of_system(system: System) -> DeckFromScene:
    """Return the functions for a system's deck model."""
    kind = type(system.deck_model)
    load_folder(_FOLDER)
    return next(
        deck_model.from_scene for deck_model in DECK_MODELS.values() if deck_model.kind is kind
    )


def require_built_in(scene: Scene, request: str) -> None:
    """Refuse a user's deck model for formulas that hold for the built-in ones only.

    Parameters
    ----------
    scene
        A checked scene.
    request
        Name of the request that uses the formulas, for the message.

    Raises
    ------
    SceneError
        The scene names a user's deck model; the message names key, value, allowed models and
        remedy.
    """
    name = scene.deck_model
    if name in (None, PLANAR, IN_SPACE):
        return
    raise SceneError(
        f"deck_model = {name!r}: {request} needs the equations of a built-in deck model; "
        f"allowed here: {IN_SPACE}, {PLANAR}; take deck_model out of the scene (--set "
        "deck_model=), or simulate this deck instead, without faults of balls, mounts and disc"
    )
