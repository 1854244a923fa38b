"""Poses of a URDF's links, computed independently of the package's code."""

from collections.abc import Mapping
from xml.etree import ElementTree as Xml

import numpy as np
from scipy.spatial.transform import Rotation

Pose = np.ndarray
"""Homogeneous matrix, shape (4, 4)."""


def pose(place: np.ndarray, turn: Rotation) -> Pose:
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = turn.as_matrix(), place
    return made


def numbers(text: str) -> np.ndarray:
    return np.array([float(number) for number in text.split()])


class Tree:
    """Links of a URDF, which must form one tree."""

    def __init__(self, text: str) -> None:
        robot = Xml.fromstring(text)
        assert robot.tag == "robot" and robot.get("name")
        self.links = {link.get("name"): link for link in robot.findall("link")}
        self.joints = {joint.get("name"): joint for joint in robot.findall("joint")}
        assert len(self.links) == len(robot.findall("link")), "each name once"
        assert len(self.joints) == len(robot.findall("joint")), "each name once"
        self._above = {joint.find("child").get("link"): joint for joint in self.joints.values()}
        assert len(self._above) == len(self.joints), "a link hangs on one joint"
        (self.root,) = self.links.keys() - self._above.keys()
        materials = {material.get("name") for material in robot.findall("material")}
        assert {used.get("name") for used in robot.iter("material")} == materials

    def of_kind(self, kind: str) -> list[str]:
        """Return the names of the joints of a kind."""
        return [name for name, joint in self.joints.items() if joint.get("type") == kind]

    def place(self, link: str, joints: Mapping[str, float], floating: Mapping[str, Pose]) -> Pose:
        """Return a link's pose on the root's axes, for joint angles [rad] and floating poses."""
        if link == self.root:
            return np.eye(4)
        joint = self._above[link]
        parent = self.place(joint.find("parent").get("link"), joints, floating)
        origin = joint.find("origin")
        fixed = pose(
            numbers(origin.get("xyz")), Rotation.from_euler("xyz", numbers(origin.get("rpy")))
        )
        moved, name = np.eye(4), joint.get("name")
        if joint.get("type") == "continuous":
            axis = numbers(joint.find("axis").get("xyz"))
            moved = pose(np.zeros(3), Rotation.from_rotvec(joints[name] * axis))
        elif joint.get("type") == "floating":
            moved = floating[name]
        return parent @ fixed @ moved

    def spheres(self, link: str) -> list[float]:
        """Return the radii of a link's spheres."""
        return [float(ball.get("radius")) for ball in self.links[link].iter("sphere")]
