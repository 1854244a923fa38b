"""Derivatives of what a run is judged by, through the merits' own definitions.

A merit is a function of a run's samples and its scene. Samples are moved along their exact
derivatives, the scene with them, and the merit is taken of each: differences of fourth order, so
near that they are exact to some 1e-10. What has a jump or a kink there is seen, and refused.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ab_sim.analysis.merits import merits_of
from ab_sim.analysis.merits.merit import Merit, MeritKind, merits_named
from ab_sim.analysis.sensitivity.along import derivative_along
from ab_sim.analysis.sensitivity.keys import NoDerivative, RealKey
from ab_sim.drive.trajectory import Trajectory
from ab_sim.errors import InputError
from ab_sim.presentation import Column, Columns, Presented
from ab_sim.scene.model import Scene
from ab_sim.stepping.fixed_step import ANGLE

NEAR = 1e-4
"""How far samples are moved, of the largest of their channel."""
SMOOTH = 1e-2
"""Share of a derivative by which one of one step and one of two may differ."""
ROUNDING = 1e-9
"""Share of a merit, by percent of the key, that may be rounding."""


@dataclass(frozen=True, repr=False)
class MeritSensitivities(Presented):
    """Derivatives of a run's merits by numbers of its scene; see ``Sensitivities.of_merits``."""

    _picture = "merit_sensitivities"

    scene: Scene
    merits: tuple[str, ...]
    """Names."""
    merit_units: tuple[str, ...]
    """As reports give them: e, mm/s, else SI."""
    merit_values: np.ndarray
    """Shape (merits,)."""
    keys: tuple[str, ...]
    """Of the scene."""
    key_units: tuple[str, ...]
    """SI."""
    values: np.ndarray
    """Of the keys, shape (keys,)."""
    derivatives: np.ndarray
    """d merit / d key, shape (merits, keys)."""

    @property
    def elasticities(self) -> np.ndarray:
        """Percent of the merit per percent of the key, shape (merits, keys); NaN of a merit 0."""
        merits = np.where(self.merit_values == 0.0, np.nan, self.merit_values)
        found: np.ndarray = self.derivatives * self.values / merits[:, None]
        return found

    def unit(self, merit: int, key: int) -> str:
        """Of a derivative, by the numbers of merit and key."""
        below = self.key_units[key]
        below = f"({below})" if "/" in below or " " in below else below
        return self.merit_units[merit] if below == "1" else f"{self.merit_units[merit]}/{below}"

    def report(self) -> dict[str, object]:
        """As JSON-able values, SI units but for the merits' own."""
        return {
            "scene": self.scene.name,
            "merits": {
                name: {
                    "value": float(self.merit_values[i]),
                    "unit": self.merit_units[i],
                    "by": {
                        key: {
                            "value": float(self.values[k]),
                            "unit": self.key_units[k],
                            "derivative": float(self.derivatives[i, k]),
                            "elasticity": _number(self.elasticities[i, k]),
                        }
                        for k, key in enumerate(self.keys)
                    },
                }
                for i, name in enumerate(self.merits)
            },
        }

    def _facts(self) -> dict[str, str]:
        return {
            "scene": self.scene.name,
            "merits": ", ".join(self.merits),
            "keys": str(len(self.keys)),
        }

    def _columns(self) -> Columns:
        found = {"key": Column(None, list(self.keys)), "value": Column(None, self.values)}
        for i, merit in enumerate(self.merits):
            unit = f"{self.merit_units[i]} per unit of the key"
            found[f"d {merit}"] = Column(unit, self.derivatives[i])
            found[f"elasticity of {merit}"] = Column("1", self.elasticities[i])
        return found


def of_merits(
    scene: Scene,
    run: Trajectory,
    keys: Sequence[RealKey],
    derivatives: np.ndarray,
    names: Sequence[str],
) -> MeritSensitivities:
    """Derivatives of merits; see ``Sensitivities.of_merits``.

    Args:
        scene: what was run.
        run: every step of it.
        keys: of the scene.
        derivatives: of the run's channels from the spindle's angle on, those of sensors apart, at
            all samples; shape (channels, keys, samples).
        names: of the merits.
    """
    asked = differentiable_merits(names)
    values = _values(run, scene, asked)
    found = np.empty((len(asked), len(keys)))
    for k, key in enumerate(keys):
        found[:, k] = _by_key(scene, run, key, derivatives[:, k].T, asked)
    return MeritSensitivities(
        scene,
        tuple(merit.key for merit in asked),
        tuple(merit.unit for merit in asked),
        values,
        tuple(key.key for key in keys),
        tuple(key.unit for key in keys),
        np.array([key.value for key in keys]),
        found,
    )


def differentiable_merits(names: Sequence[str]) -> list[Merit[Any]]:
    """Merits of these names.

    Raises:
        InputError: there is no such merit, it is no number, or jumps from sample to sample.
    """
    found = merits_named(names)
    for merit in found:
        if merit.kind is not MeritKind.NUMBER:
            raise InputError(f"merit {merit.key!r}: is no number, and has no derivative")
        if merit.stepwise:
            raise InputError(
                f"merit {merit.key!r}: is the time of a sample, jumps from one to the next, and "
                "has no derivative"
            )
    return found


def _by_key(
    scene: Scene, run: Trajectory, key: RealKey, way: np.ndarray, merits: Sequence[Merit[Any]]
) -> np.ndarray:
    """Of each merit, along the samples' way, shape (samples, channels)."""
    own = slice(ANGLE, ANGLE + way.shape[1])

    def judged(samples: np.ndarray, there: Scene) -> np.ndarray:
        beside = run.samples.copy()
        beside[:, own] = samples
        return _values(Trajectory(run.channels, beside), there, merits)

    found = derivative_along(judged, run.samples[:, own], way, scene, key, NEAR)
    here = np.abs(found.values[2])
    smooth = found.is_smooth(SMOOTH, ROUNDING * here / (abs(key.value) or 1.0))
    if not smooth.all():
        merit = merits[int(np.argmin(smooth))]
        raise NoDerivative(
            f"merit {merit.key!r} by {key.key}: has a jump or a kink just here, and no derivative; "
            "change the scene a little",
            key.key,
        )
    return found.derivative


def _values(run: Trajectory, scene: Scene, merits: Sequence[Merit[Any]]) -> np.ndarray:
    judged = merits_of(run, scene, [merit.key for merit in merits])
    found = []
    for merit in merits:
        value = judged[merit.key]
        if not isinstance(value, float | int):
            raise InputError(
                f"merit {merit.key!r}: has no value in this run, and no derivative "
                f"(`ab-sim merits {merit.key}` says when)"
            )
        found.append(float(value))
    return np.array(found)


def _number(x: float) -> float | None:
    return float(x) if np.isfinite(x) else None
