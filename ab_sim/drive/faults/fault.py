"""Faults as texts: a component, a kind of fault, and a size, such as ``mount_0 softens 0.5``.

Faults of sensors alter readings, and messages drop out.
"""

import math
import random
from collections.abc import Callable, Iterable, Sequence, Set
from typing import NamedTuple

import numpy as np

from ab_sim.base.errors import InputError, exact, nearest
from ab_sim.base.numbers import number_in
from ab_sim.drive.disc import turns_alike
from ab_sim.drive.pickup import digits
from ab_sim.model.dynamics.registry import require_built_in
from ab_sim.scene.model import Scene
from ab_sim.scene.sensors import steps_per_sample

VIBRATION = "vibration"
"""Name of the deck's acceleration as a sensor, in scenes without sensors."""
_IN_THE_PLANE = ("suspension", "unequal_suspension")
"""Effects that hold the deck in the plane."""
SPINDLE = "spindle"
"""Name of the sensor of the spindle's speed."""


class Fault(NamedTuple):
    """Fault of one component; see ``KINDS``."""

    component: str
    """Component with the fault, e.g. ``mount_0``."""
    verb: str
    """Kind of the fault, a key of ``KINDS``."""
    size: float | None
    """Size of the fault; None if its kind has none."""

    @property
    def text(self) -> str:
        """Return the fault as text, in the form that ``faults_of`` parses."""
        words = f"{self.component} {self.verb}"
        return words if self.size is None else f"{words} {exact(self.size)}"


class FaultKind(NamedTuple):
    """Kind of fault: its meaning, the components that can have it, and its size."""

    meaning: str
    """Behaviour of a component with the fault, in words."""
    components: Callable[[Scene], Sequence[str]]
    """Function that returns the components of a scene that can have the fault."""
    size: str = ""
    """Meaning and unit of the size; empty: no size."""
    allowed: Callable[[float], bool] = math.isfinite
    """Function that returns whether a size is allowed."""
    words: str = ""
    """Allowed sizes in words, for messages."""
    usual: float | None = None
    """Default size; None: a size is required."""


def balls_of(scene: Scene) -> list[str]:
    """Return the names of the balls, as in ``joint_states``."""
    return [f"ball_{i}" for i in range(scene.balls.count)]


def _supports_of(scene: Scene) -> list[str]:
    """Return the names of the deck's supports: the suspension in the plane, mounts in space."""
    return _mounts_of(scene) or [name for name in scene.effects if name in _IN_THE_PLANE]


def _mounts_of(scene: Scene) -> list[str]:
    return [f"mount_{k}" for k in range(len(scene.mounts))]


def _sensors_of(scene: Scene) -> list[str]:
    """Return the names of all sensors: accelerometers, probes, and the spindle's speed."""
    return [*(scene.sensors or [VIBRATION]), *scene.probes, SPINDLE]


def _on_axes(scene: Scene) -> list[str]:
    return [name for name in _sensors_of(scene) if name != SPINDLE]


def _disc(_: Scene) -> list[str]:
    return ["disc"]


KINDS = {
    "sticks": FaultKind("stops at once at its place in the race", balls_of),
    "lost": FaultKind("leaves the race, with its mass", balls_of),
    "softens": FaultKind(
        "keeps this part of its stiffness, and all of its damping",
        _supports_of,
        "the remaining part",
        lambda part: 0.0 < part < 1.0,
        "between 0 and 1",
    ),
    "slips": FaultKind(
        "falls behind the hub, in small jerks",
        _disc,
        "rad/s",
        lambda rate: 0.0 < abs(rate) <= 100.0,
        "not 0, from -100 to 100",
    ),
    "drops": FaultKind(
        "reports nothing for this part of its messages",
        _sensors_of,
        "the part of its messages that is lost",
        lambda part: 0.0 < part <= 1.0,
        "above 0, at most 1",
        1.0,
    ),
    "saturates": FaultKind(
        "reports at most this magnitude",
        _sensors_of,
        "in its unit",
        lambda most: 0.0 <= most <= 1e9,
        "from 0 to 1e9",
    ),
    "drifts": FaultKind(
        "has a growing offset on all its axes",
        _sensors_of,
        "in its unit per second",
        lambda rate: 0.0 < abs(rate) <= 1e9,
        "not 0, from -1e9 to 1e9",
    ),
    "turned": FaultKind(
        "is turned about the shaft from its stated axes",
        _on_axes,
        "rad",
        lambda angle: 0.0 < abs(angle) <= math.pi,
        "not 0, from -pi to pi",
    ),
}
"""Kinds of faults by the verb that stands in a fault's text."""
OF_BALLS = ("sticks", "lost")
_OF_THE_PLANT = (*OF_BALLS, "softens")
"""Kinds that change constants of the equations of motion."""
_SENSED = ("turned", "drifts", "saturates", "drops")
"""Kinds that alter sensor readings, in the order in which they act on a reading."""


def faults_of(texts: Iterable[str]) -> tuple[Fault, ...]:
    """Parse faults; empty texts are skipped. Use ``check_faults`` for the components of a scene.

    Raises
    ------
    InputError
        A text is not a fault, or two faults exclude each other.
    """
    faults = tuple(_fault(text) for text in texts if text.strip())
    for k, fault in enumerate(faults):
        for other in faults[:k]:
            same = other.component == fault.component
            both = {other.verb, fault.verb} == set(OF_BALLS)
            if same and (both or other.verb == fault.verb):
                raise InputError(
                    f"faults: {other.text!r} and {fault.text!r} exclude each other; keep one"
                )
    return faults


def of_the_plant(faults: Iterable[Fault]) -> tuple[Fault, ...]:
    """Return the faults that change the motion, not those of sensors or of the disc's angle."""
    return tuple(fault for fault in faults if fault.verb in _OF_THE_PLANT)


def check_faults(faults: Iterable[Fault], scene: Scene) -> None:
    """Refuse faults that have no meaning in a scene.

    Raises
    ------
    InputError
        A fault does not apply; the message states the reason or suitable components.
    SceneError
        The fault changes quantities that only built-in deck models have.
    """
    for fault in faults:
        there = KINDS[fault.verb].components(scene)
        if fault.component not in there:
            raise InputError(
                f"faults: {fault.text!r}: {fault.verb!r} goes with "
                f"{', '.join(there) or 'nothing'} in this scene{nearest(fault.component, there)}"
            )
        if fault.verb in OF_BALLS or fault.verb == "slips" or fault.component in _mounts_of(scene):
            require_built_in(scene, f"faults: {fault.text!r}")
        if fault.verb in OF_BALLS and "ball_contact" in scene.effects:
            raise InputError(
                f"faults: {fault.text!r}: balls push each other (ball_contact), and a stuck or "
                "lost ball in their row is not modelled; remove the effect"
            )
        if fault.verb == "slips":
            _check_slip(fault, scene)


def _check_slip(fault: Fault, scene: Scene) -> None:
    """Refuse a slipping disc in a scene where more than the unbalance's direction would change."""
    if "race_runout" in scene.effects:
        raise InputError(
            f"faults: {fault.text!r}: the race is off the shaft (race_runout), and would not turn "
            "with the disc; remove the effect"
        )
    if not turns_alike(scene):
        raise InputError(
            f"faults: {fault.text!r}: rotor.inertia of {scene.name} is not the same all around the "
            "shaft, and the disc's part of it is unknown; give an inertia of the form [xx, xx, zz]"
        )


def _fault(text: str) -> Fault:
    """Parse one fault; raise InputError if the text is not one."""
    component, verb, number = (*text.split(), "", "")[:3]
    kind = KINDS.get(verb)
    if kind is None or len(text.split()) > 3:
        raise InputError(
            f"faults: {text!r}: must be an object and its fault, e.g. 'ball_0 sticks'; known are "
            + ", ".join(_usage(kind) for kind in KINDS)
            + (nearest(verb, KINDS) if kind is None else "")
        )
    if not number:
        if kind.size and kind.usual is None:
            raise InputError(f"faults: {text!r}: needs a number, {kind.size}, {kind.words}")
        return Fault(component, verb, kind.usual)
    try:
        size = number_in(number)
    except ValueError:
        size = math.nan
    if not kind.size or not kind.allowed(size):
        must = f"must be {kind.words} ({kind.size})" if kind.size else "this fault takes no number"
        raise InputError(f"faults: {text!r}: {number}: {must}")
    return Fault(component, verb, size)


def _usage(verb: str) -> str:
    """Return how a kind of fault is written, with its meaning, for messages."""
    kind = KINDS[verb]
    number = "" if not kind.size else " NUMBER" if kind.usual is None else " [NUMBER]"
    return f"{verb}{number} ({kind.meaning})"


class SensedFaults:
    """Sensor faults, each with the step at which it started.

    Parameters
    ----------
    faults
        Faults of a drive; only those of sensors are used.
    scene
        The drive's scene.
    """

    def __init__(self, faults: Iterable[Fault], scene: Scene) -> None:
        sensed = [fault for fault in faults if fault.verb in _SENSED]
        self._faults = sorted(sensed, key=lambda fault: _SENSED.index(fault.verb))
        self._scene, self._step = scene, scene.solver.step
        self._since: dict[Fault, int] = {}
        self.restart(0)

    def restart(self, now: int) -> None:
        """Let all faults start at step ``now``."""
        self._since = {fault: now for fault in self._faults}

    def keep_starts_of(self, before: "SensedFaults") -> None:
        """Keep the start of faults that were already in force in another drive."""
        self._since |= {f: at for f, at in before._since.items() if f in self._since}

    def count_from(self, now: int, then: int) -> None:
        """Keep the ages of all faults when step ``now`` is renumbered as ``then``."""
        self._since = {fault: at + then - now for fault, at in self._since.items()}

    def silent(self, step: int) -> Set[str]:
        """Return the sensors that report nothing at a step."""
        return {fault.component for fault in self._faults if _drops(fault, step)}

    def sampled(
        self, name: str, steps: np.ndarray, readings: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the steps at which one sensor reports, and its readings there.

        Parameters
        ----------
        name
            Name of the sensor.
        steps
            Steps of the samples, shape (samples,).
        readings
            Readings without faults [SI], shape (samples, axes).
        """
        faults = [fault for fault in self._faults if fault.component == name]
        if not faults:
            return steps, readings
        kept = np.array([not any(_drops(f, at) for f in faults) for at in steps.tolist()], bool)
        steps, readings = steps[kept], readings[kept]
        return steps, self.altered(name, readings.T, steps).T

    def altered(self, name: str, true: np.ndarray, steps: np.ndarray) -> np.ndarray:
        """Return the readings of one sensor after its faults have altered them, shape as ``true``.

        Parameters
        ----------
        name
            Name of the sensor.
        true
            Readings without faults [SI], shape (axes,) or (axes, samples).
        steps
            Steps of the samples, shape (samples,).
        """
        readings, sensor = true, self._scene.pickups.get(name)
        for fault in self._faults:
            if fault.component != name or fault.size is None:
                continue
            if fault.verb == "turned":
                c, s = math.cos(fault.size), math.sin(fault.size)
                readings = np.array(
                    [
                        c * readings[0] + s * readings[1],
                        c * readings[1] - s * readings[0],
                        *readings[2:],
                    ]
                )
            elif fault.verb == "drifts":
                every = 1 if sensor is None else steps_per_sample(sensor.sample_rate, self._step)
                # A sensor holds each sample, and with it the drift at the sample's step.
                age = np.maximum(steps - steps % every - self._since[fault], 0)
                readings = readings + fault.size * self._step * age
            elif fault.verb == "saturates":
                readings = np.clip(readings, -fault.size, fault.size)
            if sensor is not None and fault.verb in ("turned", "drifts"):
                readings = digits(sensor, readings)
        return readings


def _drops(fault: Fault, step: int) -> bool:
    """Return whether a sensor's message at a step is lost, at random but repeatably."""
    if fault.verb != "drops" or fault.size is None:
        return False
    return random.Random(f"{fault.text} {int(step)}").random() < fault.size
