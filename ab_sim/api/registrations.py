"""Registrations that end."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from ab_sim.analysis.metrics import reported_metrics
from ab_sim.analysis.metrics.metric import METRICS
from ab_sim.base.named_entries import NamedEntries
from ab_sim.engine.integrate.registry import FAMILIES, steppers
from ab_sim.model.dynamics.registry import DECK_MODELS, deck_models
from ab_sim.scene.registry import EFFECTS, effect_classes


@contextmanager
def temporary_registrations() -> Iterator[None]:
    """Return a context manager that undoes the registrations made within it.

    Use it in tests, and in notebooks in which a cell that registers a class runs again. It applies
    to effects, metrics, steppers and deck models.

    Returns
    -------
    context manager
        Context without a value.

    Examples
    --------
    >>> import ab_sim
    >>> from typing import NamedTuple
    >>> for cost in (1.0, 2.0):
    ...     with ab_sim.temporary_registrations():
    ...         @ab_sim.register_effect("pull", equation="f = -c", source="this page")
    ...         class Pull(NamedTuple):
    ...             force: float = cost
    """
    for read in (effect_classes, reported_metrics, steppers, deck_models):
        read()  # registers those of the package and of plug-ins, which stay
    registries: tuple[NamedEntries[Any], ...] = (EFFECTS, METRICS, FAMILIES, DECK_MODELS)
    before = [dict(registry) for registry in registries]
    try:
        yield
    finally:
        for registry, entries in zip(registries, before, strict=True):
            registry.clear()
            registry.update(entries)
