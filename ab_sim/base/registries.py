"""Registries of higher rooms that lower rooms read, each imported when it is first needed.

Lower rooms cannot import them: they import these rooms themselves, and take long. This table is the
only place where a module is named that lies above.
"""

from importlib import import_module
from typing import Any

REGISTRIES = {
    "deck models": "ab_sim.model.dynamics.registry",
    "effects": "ab_sim.model.equations.effects",
    "figures": "ab_sim.show.result_figures",
    "steppers": "ab_sim.engine.integrate.registry",
}
"""Module of each registry. That of the effects fills the registry in ``ab_sim.scene``."""


def registry(name: str) -> Any:
    """Return the module of a registry in ``REGISTRIES``."""
    return import_module(REGISTRIES[name])
