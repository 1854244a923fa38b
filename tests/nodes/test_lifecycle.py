"""`drive_sim` as a lifecycle node, with real processes."""

import signal
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.srv import DescribeParameters, ListParameters
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_srvs.srv import Trigger

from ab_msgs_py import ENDED, Block, JointSample, Level, services, topics
from ab_msgs_py.samples import description_of
from ab_sim.scene import find_scene
from tests.nodes.fleet import Fleet
from tests.nodes.slow_to_compile import COMPILES, MODULE

pytestmark = pytest.mark.ros

DRIVE = "left/drive_sim"
SERVICES = (
    services.STEP,
    services.RESET,
    services.RESET_TIME,
    services.RESET_STATE,
    services.LOAD_SCENE,
    services.LOAD_DISC,
    services.SAVE_SNAPSHOT,
    services.RESTORE_SNAPSHOT,
    services.EMERGENCY_STOP,
    services.RESET_EMERGENCY_STOP,
)
LIFE_CYCLE = {
    ChangeState: "change_state",
    GetState: "get_state",
    ListParameters: "list_parameters",
    DescribeParameters: "describe_parameters",
}
LEASE = 20.0
"""s for which Fast DDS goes on to show who has gone without a word."""
ROSS_OWN = {"use_sim_time", "start_type_description_service"}


def refused(fleet: Fleet, *words: str, triggers: Sequence[str] = SERVICES[:1]) -> None:
    answers = [fleet.call(service.replace("~", DRIVE)) for service in triggers]
    answers.append(fleet.call(f"{DRIVE}/pause", True))
    for done, text in answers:
        assert not done and all(word in text for word in words), text


def told(fleet: Fleet, level: Level, *words: str) -> None:
    fleet.until(
        lambda: (
            (health := fleet.health(DRIVE))
            and health.level is level
            and all(word in health.message for word in words)
        ),
        f"diagnostics: {level} {words}",
    )


def listeners(fleet: Fleet) -> int:
    return fleet.node.count_subscribers("/left/spindle/command")


def gone(fleet: Fleet, node: str) -> None:
    """It leaves the graph by itself, and not only when its DDS lease ends, 20 s later."""
    fleet.until(lambda: node not in fleet.node.get_node_names(), f"{node} leaves", LEASE / 2)


def described_parameters(fleet: Fleet) -> dict[str, Any]:
    listed = fleet.ask(ListParameters, f"{DRIVE}/list_parameters", ListParameters.Request())
    names = list(listed.result.names)
    request = DescribeParameters.Request(names=names)
    answer = fleet.ask(DescribeParameters, f"{DRIVE}/describe_parameters", request)
    return dict(zip(names, answer.descriptors, strict=True))


def test_a_life(fleet: Fleet, tmp_path: Path) -> None:
    """Every state and transition of one process."""
    joints, blocks, described = (
        fleet.listen(topic._replace(name=f"left/{topic.name}"))
        for topic in (topics.JOINT_STATES, topics.BLOCK, topics.DESCRIPTION)
    )
    scene = tmp_path / "mine.yaml"
    scene.write_text("rotor: {}")
    override = {"qos_overrides./left/whirl.publisher.reliability": "best_effort"}
    fleet.start(DRIVE, autostart=False, scene=scene, **override)

    for service in SERVICES:
        fleet.meet(Trigger, service.replace("~", DRIVE))
    for kind, name in LIFE_CYCLE.items():
        fleet.meet(kind, f"{DRIVE}/{name}")

    # Unconfigured.
    told(fleet, Level.OK, "unconfigured")
    health = fleet.health(DRIVE)
    assert health is not None and health.hardware == "left/mine"
    assert fleet.state(DRIVE) == "unconfigured"
    way = "`ros2 lifecycle set /left/drive_sim configure`"
    refused(fleet, "unconfigured", way, triggers=SERVICES)
    assert not fleet.change(DRIVE, "activate")

    # A scene that cannot be used.
    assert not fleet.change(DRIVE, "configure")
    assert fleet.state(DRIVE) == "unconfigured"
    told(fleet, Level.ERROR, "unconfigured", "mine.yaml")
    fleet.reads(DRIVE, "mine.yaml: duration: is missing")
    assert fleet.log(DRIVE).count("[ERROR] ") == 1

    # Inactive, with the parameters as they are by then.
    scene.write_text(find_scene("thesis-hold").read_text())
    assert fleet.set(DRIVE, acceleration_limit=30.0)[0]
    assert fleet.change(DRIVE, "configure")
    assert fleet.state(DRIVE) == "inactive"
    told(fleet, Level.OK, "inactive")
    fleet.until(lambda: described, "a description")
    refused(fleet, "inactive", "`ros2 lifecycle set /left/drive_sim activate`")
    assert fleet.set(DRIVE, speed_limit=50.0, time_mode="lock_step", error_checks=0.0)[0]
    assert fleet.set(DRIVE, time_mode="paced")[0]
    assert not joints and not blocks and not listeners(fleet)

    # Active.
    for name, descriptor in described_parameters(fleet).items():
        assert descriptor.description or name in ROSS_OWN, name
    (info,) = fleet.node.get_publishers_info_by_topic("/left/whirl")
    assert info.qos_profile.reliability is ReliabilityPolicy.BEST_EFFORT
    assert fleet.change(DRIVE, "activate")
    fleet.until(lambda: len(joints) > 20 and listeners(fleet), "it runs")
    for limit, value in (("speed limit [rad/s]", "50"), ("acceleration limit [rad/s^2]", "30")):
        fleet.until(lambda key=limit, want=value: fleet.value(DRIVE, key) == want, limit)

    # Who cannot be heard, or cannot hear, is told of.
    unsure = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    command, joint = topics.COMMAND, topics.JOINT_STATES
    fleet.node.create_publisher(command.type, "/left/spindle/command", unsure)
    fleet.node.create_subscription(joint.type, "/left/joint_states", print, latched)
    for topic, policy in (("spindle/command", "RELIABILITY"), ("joint_states", "DURABILITY")):
        fleet.until(
            lambda topic=topic, policy=policy: [
                line
                for line in fleet.log(DRIVE).splitlines()
                if "[WARN]" in line and f"'{topic}'" in line and policy in line
            ],
            f"the mismatch on {topic}",
        )

    # Inactive again, and on from there.
    assert fleet.change(DRIVE, "deactivate")
    fleet.until(lambda: not listeners(fleet), "nobody listens")
    told(fleet, Level.OK, "inactive")
    refused(fleet, "inactive")
    stood = JointSample.of(joints[-1]).time
    assert fleet.change(DRIVE, "activate")
    count = len(joints)
    fleet.until(lambda: len(joints) > count + 5, "it runs again")
    assert fleet.call(f"{DRIVE}/pause", True)[0]
    stamps = [JointSample.of(message).time for message in joints]
    assert stood in stamps and np.all(np.diff(stamps) >= 0)
    assert fleet.change(DRIVE, "deactivate")
    fleet.until(
        lambda: 1e6 * Block.of(blocks[-1]).samples[-1, 0] == JointSample.of(joints[-1]).time,
        "the last block",
    )
    steps = np.concatenate([Block.of(message).samples[:, 0] for message in blocks])
    assert np.all(np.diff(steps) == 1), "no sample is missing"

    # Another scene takes the next configure.
    assert fleet.change(DRIVE, "cleanup")
    told(fleet, Level.OK, "unconfigured")
    fleet.until(
        lambda: not fleet.node.count_publishers("/left/drive_description"), "nothing is described"
    )
    assert fleet.set(DRIVE, scene="nsc-case-1")[0]
    assert fleet.change(DRIVE, "configure") and fleet.change(DRIVE, "activate")
    fleet.until(lambda: fleet.value(DRIVE, "scene") == "nsc-case-1", "the other scene")
    assert description_of(described[-1])["scene"]["name"] == "nsc-case-1"
    health = fleet.health(DRIVE)
    assert health is not None and health.hardware == "left/nsc-case-1"
    assert fleet.call(f"{DRIVE}/pause", True) == (True, "paused"), "the pause before is forgotten"
    told(fleet, Level.OK, "paused")  # and not of a wake-up that was late before

    # The end.
    assert fleet.change(DRIVE, "shutdown")
    assert fleet.ended(DRIVE) == 0
    gone(fleet, "drive_sim")
    told(fleet, Level.OK, ENDED)
    assert "Traceback" not in fleet.log(DRIVE)


def compiles(fleet: Fleet) -> int:
    """How often it has compiled."""
    return fleet.log("drive_sim").count(COMPILES)


def test_it_answers_while_it_configures(fleet: Fleet) -> None:
    # Compiling takes longer than all that is asked.
    fleet.start("drive_sim", MODULE, "60", scene="no-ball", autostart=False)
    client = fleet.node.create_client(ChangeState, "drive_sim/change_state")
    assert fleet.state("drive_sim") == "unconfigured"
    fleet.until(client.service_is_ready, "transitions")
    request = ChangeState.Request(transition=Transition(label="configure"))
    configured = client.call_async(request)
    fleet.until(lambda: compiles(fleet), "it compiles")
    assert fleet.state("drive_sim") == "configuring"
    assert fleet.set("drive_sim", speed_limit=50.0)[0]
    assert not fleet.change("drive_sim", "shutdown")
    assert not fleet.call("drive_sim/reset")[0]
    assert fleet.state("drive_sim") == "configuring" and not configured.done()
    assert fleet.stop("drive_sim", signal.SIGTERM) == 0
    fleet.until(lambda: (h := fleet.health("drive_sim")) and h.message == ENDED, "last words")
    gone(fleet, "drive_sim")
    assert "Traceback" not in fleet.log("drive_sim")


def test_it_leaves_while_a_request_compiles(fleet: Fleet) -> None:
    fleet.start("drive_sim", MODULE, "1", scene="no-ball")
    fleet.until(lambda: fleet.value("drive_sim", "scene"), "it runs")
    before = compiles(fleet)
    # A scene that the process from which nodes are forked has not run.
    assert before and fleet.set("drive_sim", scene="nsc-case-1")[0]
    client = fleet.node.create_client(Trigger, "drive_sim/load_scene")
    fleet.until(client.service_is_ready, "the service")
    client.call_async(Trigger.Request())
    fleet.until(lambda: compiles(fleet) > before, "it compiles")
    assert fleet.stop("drive_sim", signal.SIGTERM) == 0
    gone(fleet, "drive_sim")
    assert "Traceback" not in fleet.log("drive_sim")
