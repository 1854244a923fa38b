"""What to simulate: the scene's sections, checked, and how a scene file is found and read."""

from ab_sim.scene.load import check_scene, find_scene, load_scene, scene_names
from ab_sim.scene.model import Scene

__all__ = ["Scene", "check_scene", "find_scene", "load_scene", "scene_names"]
