"""Scenes: sections of a simulation's input, their checks, and their files."""

from ab_sim.base.yaml_files import find_scene, scene_names
from ab_sim.scene.load import check_scene, load_scene
from ab_sim.scene.model import Scene

__all__ = ["Scene", "check_scene", "find_scene", "load_scene", "scene_names"]
