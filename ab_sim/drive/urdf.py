"""Conversion of a scene to a URDF, for RViz and robot_state_publisher.

    drive_housing -> deck -> spindle -> race_k -> ball_i_arm -> ball_i

The joints `spindle` and `ball_i` are those of ``joint_states``, so robot_state_publisher moves
them. The deck has a joint of the type *floating*, for which robot_state_publisher publishes
nothing; the drive publishes the deck's pose on tf. So every frame has one publisher, decks in the
plane and in space have the same tree, and ``joint_states`` contains only values that a drive's
encoder could measure. Sensors are drawn on the deck without links, because the drive publishes
their frames, too.

Lengths are those of the scene, without exaggeration, and a runout of the race is left out. Missing
radii of balls, disc and plate are replaced by stand-ins, as in other pictures (``PLATE``, ``DISC``,
``ball_radius``). No link has an inertia: a URDF cannot describe mounts and race, so a simulator
could not rebuild this drive from it.
"""

import math
from collections.abc import Sequence
from xml.etree import ElementTree as Xml

from ab_sim.scene.model import Scene
from ab_sim.scene.sensors import DECK, HOUSING, SPINDLE, arm_frame, ball_frame, race_frame

Place = Sequence[float]

PLATE = 1.7
"""Half the side of the square plate that stands for a deck without mounts, in race radii."""
DISC = 1.3
"""Radius of the disc, in race radii."""
MARK, MARK_PLACE = 0.07, 1.1
"""Radius of the mark that shows the unbalance's direction, and distance of the mark from the shaft,
in race radii."""
_COLOURS = {
    "plate": "0.43 0.59 0.75 0.4",
    "mount": "0.75 0.75 0.47 1",
    "sensor": "0.1 0.6 0.5 1",
    "disc": "0.3 0.32 0.36 0.4",
    "race": "0.6 0.6 0.6 0.3",
    "ball": "0.8 0.8 0.85 1",
    "unbalance": "0.84 0.37 0 1",
}
"""Red, green, blue, opacity of each material."""
_ORIGIN = (0.0, 0.0, 0.0)
_THIN = 0.02
"""Thickness of plate and disc, in race radii."""


_UNLIMITED = 1e6
"""Effort limit of a spindle without a motor model [N m], the largest that a motor may have."""
_ROS2_CONTROL = {
    "joint_commands_topic": "spindle/joint_command",
    "joint_states_topic": "joint_states",
    "trigger_joint_command_threshold": "1e-6",
}
"""Parameters of ros2_control's topic hardware."""


def urdf_of(scene: Scene, ros2_control: bool = False) -> str:
    """Return the scene as a URDF, for ``robot_description``.

    Frames have the names of ``ab_sim.scene.sensors`` without a namespace, which
    robot_state_publisher and RViz put in front (`frame_prefix`, TF Prefix).

    Parameters
    ----------
    scene
        A checked scene.
    ros2_control
        Whether to add limits of the spindle and the block `<ros2_control>` of ros2_control's topic
        hardware.
    """
    robot = Xml.Element("robot", name="drive")
    for name, colour in _COLOURS.items():
        Xml.SubElement(Xml.SubElement(robot, "material", name=name), "color", rgba=colour)
    _link(robot, HOUSING)
    _deck(robot, scene)
    _spindle(robot, scene)
    for number, height in enumerate(scene.race.heights):
        _race(robot, scene, number, height)
    for ball, race in enumerate(scene.balls.races):
        _ball(robot, scene, ball, race)
    if ros2_control:
        _ros2_control(robot, scene)
    Xml.indent(robot)
    return f'<?xml version="1.0"?>\n{Xml.tostring(robot, encoding="unicode")}\n'


def _deck(robot: Xml.Element, scene: Scene) -> None:
    r, mounts = scene.race.radius, [mount.position for mount in scene.mounts]
    deck = _link(robot, DECK, HOUSING, "floating")
    if mounts:
        corners = [*mounts, (-r, -r, 0.0), (r, r, 0.0)]
        height = math.fsum(z for *_, z in mounts) / len(mounts)
    else:
        side = PLATE * r
        corners = [(-side, -side, 0.0), (side, side, 0.0)]
        height = -max(_radii(scene), default=0.0) - _THIN * r
    low, high = (tuple(map(pick, zip(*corners, strict=True))) for pick in (min, max))
    size = high[0] - low[0], high[1] - low[1], _THIN * r
    middle = 0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), height
    _visual(deck, "plate", "box", {"size": size}, middle)
    for place in mounts:
        _sphere(deck, "mount", place, 0.05 * r)
    for sensor in scene.sensors.values():
        turned = (0.0, 0.0, sensor.axis_angle)
        size = 0.1 * r, 0.06 * r, 0.03 * r
        _visual(deck, "sensor", "box", {"size": size}, sensor.position, turned)


def _spindle(robot: Xml.Element, scene: Scene) -> None:
    r, height = scene.race.radius, scene.rotor.height
    spindle = _link(robot, SPINDLE, DECK, "continuous")
    _cylinder(spindle, "disc", height, DISC * r, _THIN * r)
    _cylinder(spindle, "disc", height, 0.1 * r, 0.5 * r)
    _sphere(spindle, "unbalance", (MARK_PLACE * r, 0.0, height), MARK * r)


def _ros2_control(robot: Xml.Element, scene: Scene) -> None:
    spindle = robot.find(f"joint[@name='{SPINDLE}']")
    assert spindle is not None
    speed, motor = scene.spindle.max_speed, scene.effects.get("motor")
    limits = {"velocity": _text([speed])}
    limits["effort"] = _text([_UNLIMITED if motor is None else motor.torque_limit])
    Xml.SubElement(spindle, "limit", limits)
    block = Xml.SubElement(robot, "ros2_control", name="drive", type="system")
    hardware = Xml.SubElement(block, "hardware")
    plugin = Xml.SubElement(hardware, "plugin")
    plugin.text = "joint_state_topic_hardware_interface/JointStateTopicSystem"
    for name, text in _ROS2_CONTROL.items():
        Xml.SubElement(hardware, "param", name=name).text = text
    joint = Xml.SubElement(block, "joint", name=SPINDLE)
    command = Xml.SubElement(joint, "command_interface", name="velocity")
    for name, bound in (("min", -speed), ("max", speed)):
        Xml.SubElement(command, "param", name=name).text = _text([bound])
    for name in ("position", "velocity", "effort"):
        Xml.SubElement(joint, "state_interface", name=name)


def _race(robot: Xml.Element, scene: Scene, number: int, height: float) -> None:
    here = [a for a, race in zip(_radii(scene), scene.balls.races, strict=True) if race == number]
    widest = max(here, default=ball_radius(scene.race.radius, 0))
    race = _link(robot, race_frame(number), SPINDLE, "fixed", (0.0, 0.0, height))
    _cylinder(race, "race", 0.0, scene.race.radius + widest, 2.0 * widest)


def _ball(robot: Xml.Element, scene: Scene, ball: int, race: int) -> None:
    name, arm = ball_frame(ball), arm_frame(ball)
    _link(robot, arm, race_frame(race), "continuous", joint=name)
    link = _link(robot, name, arm, "fixed", (scene.race.radius, 0.0, 0.0), joint=f"{name}_centre")
    _sphere(link, "ball", _ORIGIN, _radii(scene)[ball])


def _radii(scene: Scene) -> list[float]:
    other = ball_radius(scene.race.radius, scene.balls.count)
    return [other if math.isnan(radius) else radius for radius in scene.balls.radii]


def _link(
    robot: Xml.Element,
    name: str,
    parent: str = "",
    kind: str = "",
    place: Place = _ORIGIN,
    joint: str = "",
) -> Xml.Element:
    """Add a link and the joint to its parent; the joint has the link's name by default."""
    link = Xml.SubElement(robot, "link", name=name)
    if parent:
        element = Xml.SubElement(robot, "joint", name=joint or name, type=kind)
        Xml.SubElement(element, "parent", link=parent)
        Xml.SubElement(element, "child", link=name)
        Xml.SubElement(element, "origin", xyz=_text(place), rpy=_text(_ORIGIN))
        if kind == "continuous":
            Xml.SubElement(element, "axis", xyz="0 0 1")
    return link


def _visual(
    link: Xml.Element,
    material: str,
    shape: str,
    sizes: dict[str, Place],
    place: Place,
    turned: Place = _ORIGIN,
) -> None:
    visual = Xml.SubElement(link, "visual")
    Xml.SubElement(visual, "origin", xyz=_text(place), rpy=_text(turned))
    texts = {name: _text(size) for name, size in sizes.items()}
    Xml.SubElement(Xml.SubElement(visual, "geometry"), shape, texts)
    Xml.SubElement(visual, "material", name=material)


def _sphere(link: Xml.Element, material: str, place: Place, radius: float) -> None:
    _visual(link, material, "sphere", {"radius": [radius]}, place)


def _cylinder(
    link: Xml.Element, material: str, height: float, radius: float, length: float
) -> None:
    sizes: dict[str, Place] = {"radius": [radius], "length": [length]}
    _visual(link, material, "cylinder", sizes, (0.0, 0.0, height))


def _text(numbers: Place) -> str:
    """Return numbers as text, with as many digits as are needed to read back the same numbers."""
    return " ".join(repr(float(number)) for number in numbers)


def ball_radius(race: float, count: int) -> float:
    """Return the radius at which balls without one are drawn, in the unit of ``race``; all fit."""
    return race * min(0.1, 2.5 / max(count, 1))
