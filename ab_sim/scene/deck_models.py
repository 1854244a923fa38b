"""The deck models that a scene may name."""

from importlib import import_module

from ab_sim.base.errors import nearest

REGISTRY = "ab_sim.model.dynamics.registry"
"""Module of the deck models. It is imported when it is needed, because it imports this package."""


def deck_model_ways() -> dict[str, int]:
    """Return the deck models by name, each with the number of axes along which its deck moves."""
    models = import_module(REGISTRY).deck_models()
    return {name: model.kind.AXES for name, model in models.items()}


def check_deck_model(name: str | None, in_space: bool) -> None:
    """Refuse an unknown deck model, or one that does not suit this scene.

    Args:
        name: name of the model in the scene; None for the default model.
        in_space: True if the scene has a section ``deck``.

    Raises:
        ValueError: the model is unknown, or made for the other kind of deck; the message names the
            known models or the remedy.
    """
    if name is None:
        return
    ways = deck_model_ways()
    if name not in ways:
        raise ValueError(
            f"deck_model = {name!r}: no such deck model{nearest(name, ways)}; known are: "
            + ", ".join(ways)
        )
    if in_space == (ways[name] > 2):
        return
    if in_space:
        raise ValueError(
            f"deck_model = {name!r}: moves in the plane of the disc, and the scene has a deck in "
            "space (deck); remove one of the two"
        )
    raise ValueError(
        f"deck_model = {name!r}: moves in space; describe the deck (sections deck and mounts), or "
        "remove it"
    )
