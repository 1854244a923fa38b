"""What to simulate: the scene's sections, checked, and how a scene file is found and read."""

from ab_sim.scene.load import find_scene, load_scene, scene_names
from ab_sim.scene.model import Scene

__all__ = ["Scene", "find_scene", "load_scene", "scene_names"]
