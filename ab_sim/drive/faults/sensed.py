"""Sensor faults: altered readings and drop-outs."""

import math
import random
from collections.abc import Iterable, Set

import numpy as np

from ab_sim.drive.faults.fault import SENSED, Fault
from ab_sim.drive.sensing import digits
from ab_sim.scene.model import Scene
from ab_sim.scene.sensors import steps_per_sample


class SensedFaults:
    """Sensor faults, each with the step at which it started.

    Args:
        faults: faults of a drive; only those of sensors are used.
        scene: the drive's scene.
    """

    def __init__(self, faults: Iterable[Fault], scene: Scene) -> None:
        sensed = [fault for fault in faults if fault.verb in SENSED]
        self._faults = sorted(sensed, key=lambda fault: SENSED.index(fault.verb))
        self._scene, self._step = scene, scene.solver.step
        self._since: dict[Fault, int] = {}
        self.begin_anew(0)

    def begin_anew(self, now: int) -> None:
        """Restart all faults at this step."""
        self._since = {fault: now for fault in self._faults}

    def go_on(self, before: "SensedFaults") -> None:
        """Keep the start of faults that were already in force in another drive."""
        self._since |= {f: at for f, at in before._since.items() if f in self._since}

    def count_from(self, now: int, then: int) -> None:
        """Renumber step ``now`` as step ``then``."""
        self._since = {fault: at + then - now for fault, at in self._since.items()}

    def silent(self, step: int) -> Set[str]:
        """Return the sensors that report nothing at a step."""
        return {fault.component for fault in self._faults if _drops(fault, step)}

    def sampled(
        self, name: str, steps: np.ndarray, readings: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the steps at which one sensor reports, and its readings there.

        Args:
            name: name of the sensor.
            steps: steps of the samples, shape (samples,).
            readings: readings without faults [SI], shape (samples, axes).
        """
        faults = [fault for fault in self._faults if fault.component == name]
        if not faults:
            return steps, readings
        kept = np.array([not any(_drops(f, at) for f in faults) for at in steps.tolist()], bool)
        steps, readings = steps[kept], readings[kept]
        return steps, self.altered(name, readings.T, steps).T

    def altered(self, name: str, true: np.ndarray, steps: np.ndarray) -> np.ndarray:
        """Return altered readings of one sensor, shape (axes,) or (axes, samples)."""
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
