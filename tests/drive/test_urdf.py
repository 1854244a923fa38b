"""A scene's URDF: one tree, whose joints put everything where the drive has it."""

import math
from xml.etree import ElementTree as Xml

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ab_msgs_py import JointSample, samples, topics
from ab_sim.drive import Drive
from ab_sim.drive.urdf import urdf_of
from ab_sim.scene import load_scene
from tests.cli.tool import ab_sim
from tests.drive.tilted import TILTED
from tests.kinematics import Tree, numbers, pose

APART = ["start.ball_angles=[0.5, 2.0]"]


def tree_of(name: str, *changes: str) -> Tree:
    return Tree(urdf_of(load_scene(name, changes)))


@pytest.mark.parametrize(
    ("name", "changes", "heights"),
    [("thesis-hold", APART, (0.0, 0.0)), ("feeding-deck", TILTED, (0.006, -0.003))],
)
def test_everything_is_where_the_drive_has_it(
    name: str, changes: list[str], heights: tuple[float, float]
) -> None:
    scene = load_scene(name, changes)
    drive, tree = Drive(scene), Tree(urdf_of(scene))
    for _ in range(3):
        drive.advance(200)
        now = drive.observe()
        c, turn = np.zeros(3), Rotation.from_quat(np.roll(now.turn, -1))
        c[: len(now.position)] = now.position
        joints = {"spindle": now.psi, "ball_0": now.theta[0], "ball_1": now.theta[1]}
        placed = {"deck": pose(c, turn)}
        for ball, height in enumerate(heights):
            angle, radius = now.psi + now.theta[ball], scene.race.radius
            on_deck = [radius * math.cos(angle), radius * math.sin(angle), height]
            at = tree.place(f"ball_{ball}", joints, placed)
            np.testing.assert_allclose(at[:3, 3], c + turn.apply(on_deck), rtol=0, atol=1e-15)
        towards = tree.place("spindle", joints, placed) @ [1.0, 0.0, 0.0, 0.0]
        unbalance = turn.apply([math.cos(now.psi), math.sin(now.psi), 0.0])
        np.testing.assert_allclose(towards[:3], unbalance, rtol=0, atol=1e-12)
    assert now.psi > 1.0 and np.ptp(now.theta) != 0.0 and np.any(c), "it has moved"


def test_moving_joints_are_those_of_joint_states() -> None:
    tree = tree_of("five-balls-8000-rpm")
    fields = JointSample(0, 0.0, 0.0, (0.0,) * 5, (0.0,) * 5, (0.0,) * 5).fields()
    assert tree.of_kind("continuous") == fields["name"]
    assert tree.of_kind("floating") == ["deck"], "drive_sim says on tf where it is"
    deck = tree.joints["deck"]
    assert (tree.root, deck.find("child").get("link")) == (samples.HOUSING, samples.DECK)
    assert deck.find("parent").get("link") == samples.HOUSING
    assert not np.any(numbers(deck.find("origin").get("xyz")))


def test_sizes_are_the_scenes() -> None:
    tree = tree_of("everything", "balls.radius=[0.002, 0.0035]", "start.ball_angles=[0.5, 1.5]")
    assert [tree.spheres(f"ball_{ball}") for ball in range(2)] == [[0.002], [0.0035]]
    (ring,) = tree.links["race_0"].iter("cylinder")
    radius = load_scene("everything", []).race.radius
    assert float(ring.get("radius")) == radius + 0.0035 and float(ring.get("length")) == 0.007


def test_balls_without_a_radius_have_room() -> None:
    scene = load_scene("feeding-deck", ["balls.count=64", "start.ball_angles="])
    assert all(map(math.isnan, scene.balls.radii))
    tree = Tree(urdf_of(scene))
    (radius,) = tree.spheres("ball_63")
    assert 0 < 64 * 2 * radius < 2 * math.pi * scene.race.radius


def test_without_balls_there_are_deck_spindle_and_race() -> None:
    assert list(tree_of("no-ball").links) == ["drive_housing", "deck", "spindle", "race_0"]


def test_sensors_are_drawn_and_are_no_links() -> None:
    """Their frames are the drive's: two publishers of one frame would be one too many."""
    sensor = "sensors.pickup={position: [0.02, -0.05, 0.01], axis_angle: 0.3}"
    bare, tree = tree_of("feeding-deck"), tree_of("feeding-deck", sensor)
    assert tree.links.keys() == bare.links.keys()
    drawn = [visual.find("origin") for visual in tree.links["deck"].findall("visual")]
    assert ("0.02 -0.05 0.01", "0.0 0.0 0.3") in [(o.get("xyz"), o.get("rpy")) for o in drawn]


def test_no_link_has_an_inertia() -> None:
    for link in tree_of("feeding-deck").links.values():
        assert {part.tag for part in link} <= {"visual"}


def test_the_command_prints_it() -> None:
    done = ab_sim("urdf", "thesis-hold", "--set", APART[0])
    assert done.stdout == urdf_of(load_scene("thesis-hold", APART))
    refused = ab_sim("urdf", "thesis-hold", "--set", "balls.radius=-1")
    assert refused.returncode == 2 and "balls.radius" in refused.stderr and not refused.stdout


def test_ros2_control_s_block_names_our_topics_and_limits() -> None:
    """As its topic hardware reads it."""
    text = ab_sim("urdf", "thesis-hold", "--ros2-control").stdout
    robot = Xml.fromstring(text)
    limit = robot.find("joint[@name='spindle']/limit")
    assert limit is not None and limit.attrib == {"velocity": "420.0", "effort": "1000000.0"}
    block = robot.find("ros2_control[@type='system']")
    assert block is not None
    plugin = "joint_state_topic_hardware_interface/JointStateTopicSystem"
    assert block.findtext("hardware/plugin") == plugin
    values = {each.attrib["name"]: each.text for each in block.findall("hardware/param")}
    assert values["joint_commands_topic"] == topics.JOINT_COMMAND.name
    assert values["joint_states_topic"] == topics.JOINT_STATES.name
    (command,) = block.findall("joint[@name='spindle']/command_interface")
    assert [each.text for each in command] == ["-420.0", "420.0"]
    states = block.findall("joint[@name='spindle']/state_interface")
    assert [each.attrib["name"] for each in states] == ["position", "velocity", "effort"]
    assert "ros2_control" not in ab_sim("urdf", "thesis-hold").stdout
