"""A topic of a stranger's own: all of it is in this file, and no file of the package knows it.

    python -m tests.msgs.test_stranger_topic NODE --ros-args ...

is a node of the package that does, for this file was read before it started.
"""

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from ab_msgs_py import Conversion, Topic, topics
from ab_msgs_py.samples import axes, header
from ab_sim.drive import Drive, published
from ab_sim.drive.description import describe
from ab_sim.record.bags.contract import decoded
from ab_sim.record.bags.exporting import export_bag
from ab_sim.record.bags.reader import Bag
from ab_sim.record.recording import Recording, open_recording
from ab_sim.scene import load_scene
from tests.recorded import read_recording

VELOCITY = Topic(
    "deck_velocity",
    "geometry_msgs/msg/Vector3Stamped",
    Conversion(
        lambda vector: {"header": header(0, "drive_housing"), "vector": axes(vector)},
        lambda message: (message.vector.x, message.vector.y, message.vector.z),
    ),
    "the deck's velocity, inertial axes",
    "m/s",
)


def _velocity(of: published.StateChannels) -> Iterator[published.Template]:
    yield published.Template((0.0, 0.0, 0.0), of.or_zero("vx", "vy", "vz"))


def add() -> None:
    """What a change to the package would do, in the places that docs/contributing.md names."""
    topics.ALL.append(VELOCITY)
    published.state_topic(VELOCITY)(_velocity)


@pytest.fixture
def added() -> Iterator[None]:
    """Known while a test runs."""
    assert VELOCITY.name not in {topic.name for topic in topics.ALL}
    add()
    yield
    topics.ALL.remove(VELOCITY)
    del published.STATE_TOPICS[VELOCITY]


def velocities_in(path: Path) -> dict[int, tuple[float, ...]]:
    """By their stamps [ns]."""
    with Bag(path) as bag:
        assert bag.topics["/deck_velocity"].type == VELOCITY.type_name
        said = [decoded(m.data, VELOCITY.type_name) for m in bag.messages({"/deck_velocity"})]
    return {m.header.stamp.sec * 10**9 + m.header.stamp.nanosec: VELOCITY.sample(m) for m in said}


def velocities_of(run: Any) -> dict[int, tuple[float, ...]]:
    """The same of a run's samples."""
    times, vx, vy = (run[name].tolist() for name in ("time", "vx", "vy"))
    return {round(1e9 * t): (x, y, 0.0) for t, x, y in zip(times, vx, vy, strict=True)}


def test_it_is_in_the_table(added: None) -> None:
    row = (
        "| `deck_velocity` | geometry_msgs/msg/Vector3Stamped | `drive_sim` "
        "| the deck's velocity, inertial axes | m/s | reliable | volatile | 10 | `publish_rate` |"
    )
    assert topics.table()[-1] == row


def test_an_exported_bag_has_it(added: None, tmp_path: Path) -> None:
    scene = load_scene("thesis-hold", ["start.speed=90.0"])
    run = Drive(scene).advance(200)
    with Recording(tmp_path / "run.rrd", description=describe(scene)) as recording:
        recording.block(run.channels, run.samples)
    export_bag(open_recording(tmp_path / "run.rrd"), tmp_path / "bag")
    told = velocities_in(tmp_path / "bag")
    assert len(told) > 40 and told.items() <= velocities_of(run).items()
    assert any(vx for vx, _, _ in told.values())


@pytest.mark.ros
def test_a_drive_publishes_it_and_a_recorder_has_it_in_a_bag(domain: int, tmp_path: Path) -> None:
    pytest.importorskip("rclpy", reason="needs ROS 2")
    from tests.nodes.fleet import Fleet

    def start(node: str, *parameters: str) -> None:
        given = [part for parameter in parameters for part in ("-p", parameter)]
        here = (sys.executable, "-m", "tests.msgs.test_stranger_topic")
        fleet.start_process(node, *here, node, "--ros-args", *given)

    fleet = Fleet(domain, tmp_path)
    try:
        heard = fleet.listen(VELOCITY)
        start("recorder", f"path:={tmp_path / 'run.rrd'}", f"bag:={tmp_path / 'bag'}")
        start("drive_sim", "scene:=thesis-hold", "start_paused:=true")
        fleet.until(lambda: fleet.value("recorder", "file"), "the recorder has a drive")
        assert fleet.call("drive_sim/pause", False)[0]
        fleet.command(20.0)
        # The recorder may have found the topic later than this listener has.
        fleet.until(lambda: len(heard) > 400, "it is published")
        for node in ("drive_sim", "recorder"):
            assert fleet.stop(node) == 0, fleet.log(node)
    finally:
        fleet.close()
    told = velocities_in(tmp_path / "bag")
    known = velocities_of(read_recording(tmp_path / "run.rrd"))
    common = told.keys() & known.keys()
    assert len(common) > 100 and all(told[time] == known[time] for time in common)
    assert any(vx for vx, _, _ in told.values())


if __name__ == "__main__":
    add()
    importlib.import_module(f"ab_sim.nodes.{sys.argv.pop(1)}").main()
