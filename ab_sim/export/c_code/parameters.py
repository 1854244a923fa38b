"""Constants of a scene as fields of a C struct: names, units, meanings, values."""

import ast
import inspect
import re
import textwrap
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from ab_sim.engine.kernels.constants import flattened
from ab_sim.model.dynamics.system import MASS, RACE_HEIGHT, RACE_RADIUS, RADIUS, System
from ab_sim.model.equations.mounts import MOUNT_UNITS
from ab_sim.model.equations.neighbours import start_angles
from ab_sim.scene.model import Scene
from ab_sim.scene.registry import effect_parameters

GIVEN = {
    "mass": ("ball_mass", MASS, "kg", "m of each ball"),
    "radius": ("ball_radius", RADIUS, "m", "a of each ball"),
    "race_radius": ("race_radius", RACE_RADIUS, "m", "R, of the circle of each ball's centre"),
    "height": ("race_height", RACE_HEIGHT, "m", "height of each ball's race along the shaft"),
}
"""Given constants of the balls, from which the others are derived.

By name in ``BallConstants``: name in C, column of ``System.balls``, unit, meaning.
"""


NOT_NEGATIVE = ("kg", "N/m", "N s/m")
"""Units of quantities that must not be negative: masses, springs and dampers."""
RADII = ("ball_radius", "race_radius")


class DriveParameter(NamedTuple):
    """Field of ``struct drive_parameters``."""

    name: str
    unit: str
    """Unit of all numbers of the field; empty if the units differ."""
    meaning: str
    values: np.ndarray
    """Numbers of the parameter; shape () for a single number."""
    inputs: tuple[str, ...]
    """Input of the model for each number; a single input for a constant of the balls."""
    units: tuple[str, ...] = ()
    """Units along the last axis of the values, if they differ."""
    is_start: bool = False
    """True if the parameter is used at the start only."""
    least: float | None = None
    """Lower bound that the parameter's effect states."""

    @property
    def is_of_balls(self) -> bool:
        """True if each ball has a value."""
        return self.is_start or self.inputs[0] in GIVEN

    @property
    def places(self) -> Iterator[tuple[str, float, str]]:
        """Yield, for each number, the C text of its member, its value and its unit."""
        for index in np.ndindex(self.values.shape):
            place = self.name + "".join(f"[{k}]" for k in index)
            unit = self.units[index[-1]] if self.units else self.unit
            yield place, float(self.values[index]), unit

    def minimum(self, unit: str) -> float | None:
        """Return the lower bound of a number with a unit; None if there is none."""
        return 0.0 if unit in NOT_NEGATIVE or self.name in RADII else self.least


def parameters_of(scene: Scene, system: System) -> list[DriveParameter]:
    """Return all fields of a scene's ``struct drive_parameters``: of deck, effects and balls."""
    deck, parameters = system.deck_model, list[DriveParameter]()
    for name, value in zip(deck._fields, deck, strict=True):
        inputs = tuple(input_ for input_, _ in flattened(value, f".0.{name}"))
        if inputs:  # a count or a choice has no inputs
            parameters.append(_of_deck(docstrings_of(type(deck))[name], name, value, inputs))
    for k, (name, effect) in enumerate(scene.effects.items()):
        described = effect_parameters(type(effect))
        for field, value in zip(effect._fields, effect, strict=True):
            inputs = tuple(input_ for input_, _ in flattened(value, f".1.{k}.{field}"))
            if inputs:
                about, of = described[field], re.sub(r"\W", "_", name)
                parameters.append(
                    DriveParameter(
                        *(f"{of}_{field}", about.get("unit", "1"), about.get("description", "")),
                        *(np.asarray(value, float), inputs),
                        least=about.get("ge", about.get("exclusiveMinimum")),
                    )
                )
    for given_name, (name, column, unit, meaning) in GIVEN.items():
        parameters.append(
            DriveParameter(name, unit, meaning, system.balls[:, column], (given_name,))
        )
    return parameters


def start_of_balls(scene: Scene) -> DriveParameter:
    """Return the start angles of the balls, which are not a constant of the equations."""
    meaning = "start angle of each ball from the unbalance, set by drive_reset"
    values = np.array(start_angles(scene), float)
    return DriveParameter("start_ball_angle", "rad", meaning, values, (), is_start=True)


def _of_deck(about: str, name: str, value: Any, inputs: tuple[str, ...]) -> DriveParameter:
    values, unit = np.asarray(value, float), re.search(r"\[([^]]+)\]", about)
    if name == "mounts":
        meaning = (
            "each mount: position on deck axes [m], stiffness [N/m] and damping [N s/m] along its "
            "three axes; these axes in the ground's frame, one after the other"
        )
        return DriveParameter(name, "", meaning, values, inputs, MOUNT_UNITS)
    meaning = re.sub(r"\s*\[[^]]+\]", "", about).strip(" ,.")
    return DriveParameter(name, unit[1] if unit else "1", meaning, values, inputs)


def docstrings_of(kind: type[Any]) -> dict[str, str]:
    """Return the docstrings of a class's fields.

    One docstring may document several fields before it.
    """
    docstrings, waiting = dict.fromkeys(kind._fields, ""), list[str]()
    try:
        (body,) = ast.parse(textwrap.dedent(inspect.getsource(kind))).body
    except OSError:  # defined at an interactive prompt
        return docstrings
    assert isinstance(body, ast.ClassDef)
    for node in body.body:
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            waiting.append(node.target.id)
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            text = inspect.cleandoc(str(node.value.value))
            docstrings |= {name: " ".join(text.split()) for name in waiting}
            waiting = []
    return docstrings
