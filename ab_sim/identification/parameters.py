"""Free parameters of a fit: keys of the scene, and parameters of single recordings."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ab_sim.base.errors import InputError, exact, short
from ab_sim.design.draws import value_of
from ab_sim.design.points import Range, variable_of
from ab_sim.identification.measured import BIAS, DELAY, DISC_ANGLE, GAIN, Measured
from ab_sim.scene.bounds import Bounds, bounds_at
from ab_sim.scene.keys import scene_keys
from ab_sim.scene.model import Scene

_WITHIN = 10.0
"""Default range of a nonzero number: this factor below and above its start value."""
ENCODER_ZERO = "encoder zero"
ANGLES, RATES = "start.ball_angles", "start.ball_rates"
POSITION, VELOCITY = "start.deck.position", "start.deck.velocity"
"""Keys of a recording's initial state; entries follow by index."""
_REFUSED = {
    "spindle": "the spindle does what was recorded",
    "profile": "the spindle does what was recorded",
    "start": "the start of each recording is fitted automatically",
    "solver": "it is not a property of the drive",
    "accuracy": "it is not a property of the drive",
    "probes": "gain, bias and delay of a probe are fitted automatically",
    "sensors": "gain, bias and delay of a sensor are fitted automatically",
    "duration": "it is not a property of the drive",
    "effects.motor": "the spindle's speed is as recorded, and no torque was measured",
}
"""Sections of a scene that cannot be fitted, with the reason."""


class FitParameter(NamedTuple):
    """Number that a fit may vary."""

    name: str
    """Key of the scene; or quantity and recording, for a single recording: ``gain of run-1``."""
    unit: str
    """SI unit of all numbers of the parameter; ``1`` if they have none."""
    start: float
    """Start value of the fit."""
    scale: float
    """Magnitude of a large change."""
    low: float
    """Lower bound of the fit."""
    high: float
    """Upper bound of the fit."""
    key: str | None
    """Dotted key in a scene; None for gain, bias and delay."""
    recording: int | None = None
    """Index of the recording of the parameter; None for a common parameter."""
    nuisance: str = ""
    """Entry of ``NUISANCES`` that the parameter is; empty for a number of the scene."""
    axis: int = 0
    """Axis of a bias."""
    least: float = -math.inf
    """Lower limit in the scene, e.g. 0 for a stiffness."""
    bases: Mapping[int, float] = {}
    """For the encoder's zero: base angle [rad] by index of each recording that shares it."""

    def belongs_to(self, recording: int | None) -> bool:
        """Return whether the recording with an index depends on the parameter.

        For None, return whether the parameter is common to all recordings.
        """
        return self.recording is None or self.recording == recording or recording in self.bases

    @property
    def is_own_angle(self) -> bool:
        """True for an angle of a single recording, which is periodic."""
        return self.recording is not None and self.unit == "rad"


def fitted_parameters(
    scene: Scene, keys: Sequence[str], bounds: Mapping[str, tuple[float, float]]
) -> list[FitParameter]:
    """Return the parameters of a scene's keys.

    Parameters
    ----------
    scene
        Scene with the start values.
    keys
        Dotted keys; a key with a number per ball ends in the ball's index: ``balls.mass.0``.
    bounds
        Bounds of some keys [SI].

    Raises
    ------
    InputError
        A key cannot be fitted; the message states the reason and the remedy.
    """
    if not keys:
        raise InputError("nothing to fit: name keys, e.g. --fit effects.suspension.stiffness")
    for key in keys:
        if keys.count(key) > 1:
            raise InputError(f"fit {key}: is named twice; name each key once")
    for key in bounds:
        if key not in keys:
            raise InputError(f"bounds {key}: is not fitted; add it to --fit, or leave it out")
    return [_fitted(scene, key, bounds.get(key)) for key in keys]


def _fitted(scene: Scene, key: str, bounds: tuple[float, float] | None) -> FitParameter:
    """Return the parameter of a key; refuse a key that is not a continuous number of the drive."""
    now, whole = _value(scene, key)
    for section, why in _REFUSED.items():
        if key == section or key.startswith(f"{section}."):
            raise InputError(f"fit {key}: cannot be fitted: {why}; leave it out")
    if isinstance(now, dict | list) and now:
        names = [f"{key}.{name}" for name in (now if isinstance(now, dict) else range(len(now)))]
        raise InputError(f"fit {key}: is not a number; fit one of {', '.join(names)}")
    above, _, last = key.rpartition(".")
    row = scene_keys(above if whole != key and last.isdecimal() else key)[0]
    if row.range.startswith("whole") or row.unit == "-":
        raise InputError(
            f"fit {key}: cannot be fitted: it is not a continuous number; leave it out"
        )
    if now is None:
        raise InputError(
            f"fit {key}: the scene {scene.name} has no value to start from; write one there, or "
            f"--set {whole}=..."
        )
    start = float(now)
    allowed = bounds_at(scene, row.key) or Bounds()
    low, high = _limits(scene, allowed, start, bounds, key)
    scale = abs(start) if start else 0.25 * (high - low)
    return FitParameter(key, row.unit, start, scale, low, high, key, least=allowed.lowest)


def _value(scene: Scene, key: str) -> tuple[Any, str]:
    """Return a key's value, and the key of the list that contains it, or else the key itself."""
    parts = key.split(".")
    for count in range(1, len(parts)):
        whole = above = ".".join(parts[:count])
        if isinstance(now := value_of(scene, whole), list | float):
            for part in parts[count:]:
                now = _entry(key, now, part, above)
                above = f"{above}.{part}"
            return now, whole
    return value_of(scene, key), key


def _entry(key: str, node: Any, part: str, above: str) -> Any:
    """Return the entry ``part`` of a list or a mapping; ``above`` is its key, ``key`` the whole."""
    if isinstance(node, list):
        if not node:
            raise InputError(
                f"fit {key}: the scene has no {above}; add {above} to the scene, or do not fit "
                "this key"
            )
        if not (part.isascii() and part.isdecimal()) or int(part) >= len(node):
            raise InputError(
                f"fit {key}: {above} has {len(node)} entries, {above}.0 to {above}.{len(node) - 1}"
            )
        return node[int(part)]
    if not isinstance(node, dict):
        raise InputError(
            f"fit {key}: {above} is one number; fit that, or give a list of them in the scene"
        )
    if part not in node:
        raise InputError(f"fit {key}: {above} has no {part}; it has {', '.join(node)}")
    return node[part]


def _limits(
    scene: Scene, allowed: Bounds, start: float, bounds: tuple[float, float] | None, key: str
) -> tuple[float, float]:
    """Return a parameter's bounds [SI]: those given, or a factor ``_WITHIN`` around the start.

    Refuse given bounds that exclude the start or exceed the scene's limits ``allowed``.
    """
    lowest, highest = allowed.lowest, allowed.highest
    if bounds is not None:
        low, high = bounds
        if not low <= start <= high:
            raise InputError(
                f"bounds {key} = {exact(low)}..{exact(high)}: the scene's value "
                f"{exact(start)} lies outside; change either"
            )
        if low < lowest or high > highest:
            raise InputError(
                f"bounds {key} = {exact(low)}..{exact(high)}: the scene takes "
                f"{exact(lowest)} to {exact(highest)} only"
            )
        return low, high
    if start == 0.0:
        raise InputError(
            f"fit {key}: begins at 0, so that its magnitude is unknown; give --bounds "
            f"{key}=LOW..HIGH, or another value in the scene"
        )
    ends = sorted((start / _WITHIN, start * _WITHIN))
    return max(ends[0], lowest), min(ends[1], highest)


def bounds_of(texts: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Parse texts ``KEY=LOW..HIGH``, with units or in SI, into bounds [SI] by key.

    Raises
    ------
    InputError
        A text has another form, or a key is given twice.
    """
    bounds: dict[str, tuple[float, float]] = {}
    for text in texts:
        key = text.partition("=")[0].strip()
        whole = key.rstrip("0123456789").rstrip(".") if key[-1:].isdecimal() else key
        read = variable_of(f"{whole}={text.partition('=')[2]}")
        if not isinstance(read, Range) or read.log:
            raise InputError(f"--bounds {short(text)}: must be KEY=LOW..HIGH")
        if key in bounds:
            raise InputError(f"--bounds {key}: is given twice; give it once")
        bounds[key] = (read.low, read.high)
    return bounds


def encoder_zero(recordings: Sequence[Measured]) -> list[FitParameter]:
    """Return the parameter for the unbalance's angle at the encoder's zero; none if it is known.

    Recordings of one drive share the encoder and thus this angle. A recording without balls
    determines it much better than one with balls.
    """
    bases = {
        number: measured.schedule.angle(0.0)
        for number, measured in enumerate(recordings)
        if DISC_ANGLE in measured.free and measured.angle_known
    }
    if not bases:
        return []
    return [
        FitParameter(
            ENCODER_ZERO, "rad", 0.0, 1.0, -math.inf, math.inf, "start.angle", min(bases),
            bases=bases,
        )
    ]  # fmt: skip


def recording_parameters(scene: Scene, measured: Measured, number: int) -> list[FitParameter]:
    """Return the parameters of a single recording: its initial state, and free nuisances.

    Parameters
    ----------
    scene
        Scene to be fitted.
    measured
        The recording.
    number
        Index of the recording.
    """

    def parameter(
        what: str, unit: str, start: float, scale: float, reach: float, key: str | None,
        nuisance: str = "", axis: int = 0,
    ) -> FitParameter:  # fmt: skip
        return FitParameter(
            f"{what} of {measured.name}", unit, start, scale, start - reach, start + reach, key,
            number, nuisance, axis,
        )  # fmt: skip

    parameters = []
    balls = scene.balls.count if measured.with_balls else 0
    for ball in range(balls):
        angle = 2.0 * math.pi * ball / max(balls, 1)
        parameters.append(
            parameter(f"start angle of ball {ball}", "rad", angle, 1.0, np.inf, f"{ANGLES}.{ball}")
        )
    if not measured.at_rest:
        top = max(measured.schedule.top_speed, 1.0)
        for ball in range(balls):
            name, key = f"start rate of ball {ball}", f"{RATES}.{ball}"
            parameters.append(parameter(name, "rad/s", 0.0, 1.0, top, key))
        length = scene.whirl_unit[0]
        # A single signal does not determine the start across its axis, which stays 0.
        across = [(abs(math.cos(axis)), abs(math.sin(axis))) for axis in measured.axes]
        seen = (0, 1) if len(across) > 1 else (int(across[0][1] > across[0][0]),)
        for axis in seen:
            name, key = f"start {'xy'[axis]}", f"{POSITION}.{axis}"
            parameters.append(parameter(name, "m", 0.0, length, np.inf, key))
        for axis in seen:
            name, key = f"start v{'xy'[axis]}", f"{VELOCITY}.{axis}"
            parameters.append(parameter(name, "m/s", 0.0, length * top, np.inf, key))
    if DISC_ANGLE in measured.free and not measured.angle_known:
        angle = measured.schedule.angle(0.0)
        parameters.append(parameter("disc angle", "rad", angle, 1.0, np.inf, "start.angle"))
    if GAIN in measured.free:
        # The range of 0.05 to 1.95 excludes 0, at which no other parameter has an influence.
        parameters.append(parameter(GAIN, "1", 1.0, 1.0, 0.95, None, GAIN))
    if BIAS in measured.free:
        for axis in range(measured.signals.shape[1]):
            what = f"{BIAS} {axis + 1}"
            parameters.append(
                parameter(what, measured.unit, 0.0, measured.rms, np.inf, None, BIAS, axis)
            )
    if DELAY in measured.free:
        between = float(np.median(np.diff(measured.time)))
        parameters.append(parameter(DELAY, "s", measured.delay, between, 50 * between, None, DELAY))
    return parameters
