"""A drive's adaptive start-up: what its controller is told, when, and what it decided."""

import math

import numpy as np

from ab_sim.control import Sensing, Settings
from ab_sim.errors import SceneError
from ab_sim.scene.adaptive import AdaptiveProfile
from ab_sim.scene.model import Scene
from ab_sim.sensing import digits, noise_variance


def settings_of(scene: Scene) -> Settings:
    """What the controller of a scene's adaptive start-up is told.

    Raises:
        SceneError: the scene's profile is of another kind.
    """
    profile = scene.profile
    if not isinstance(profile, AdaptiveProfile):
        has = "none" if profile is None else profile.kind
        raise SceneError(f"{scene.name}: profile.kind = {has}: must be adaptive")
    sensor = scene.sensors[profile.sensor]
    # While an accuracy is asked for there is no step; the noise hardly depends on it.
    step = scene.solver.step if scene.accuracy is None else 1.0 / sensor.sample_rate
    noise = math.sqrt(noise_variance(sensor, step))
    turned = math.remainder(sensor.axis_angle, 2.0 * math.pi)
    most = float(digits(sensor, np.array(sensor.range)))
    # A reading that is clipped does not say how large the vibration is.
    return profile.settings(Sensing("acceleration", 2, turned, noise), math.nextafter(most, 0.0))
