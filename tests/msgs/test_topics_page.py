"""``docs/topics.md`` says what the code does."""

import re
from pathlib import Path
from typing import Any

import pytest
import yaml

pytest.importorskip("rclpy", reason="needs ROS 2")

from rclpy.qos import DurabilityPolicy, HistoryPolicy, ReliabilityPolicy  # noqa: E402

from ab_msgs_py import services, topics  # noqa: E402
from ab_sim.drive.faults.fault import KINDS, faults_of  # noqa: E402
from ab_sim.drive.trajectory import SPINDLE_CHANNELS, channels_for  # noqa: E402
from ab_sim.equations.in_space import InSpace  # noqa: E402
from ab_sim.equations.planar import Planar  # noqa: E402

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "topics.md").read_text()
RELIABILITY = {"reliable": ReliabilityPolicy.RELIABLE, "best effort": ReliabilityPolicy.BEST_EFFORT}
DURABILITY = {
    "volatile": DurabilityPolicy.VOLATILE,
    "transient local": DurabilityPolicy.TRANSIENT_LOCAL,
}


def table(first_column: str) -> list[list[str]]:
    """The cells of the table whose first column has this name."""
    _, _, rest = PAGE.partition(f"\n| {first_column} |")
    assert rest, f"no table of {first_column}"
    rows = rest.partition("\n\n")[0].splitlines()[2:]
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]


def names_in(cell: str) -> list[str]:
    return re.findall(r"`([^`]+)`", cell)


def interface(kind: Any) -> str:
    """As ``sensor_msgs/msg/JointState``."""
    package, part = kind.__module__.split(".")[:2]
    return f"{package}/{part}/{kind.__name__}"


def test_topics_types_and_qos() -> None:
    found = {t.name: t for t in vars(topics).values() if isinstance(t, topics.Topic)}
    rows = {names_in(row[0])[0]: row for row in table("topic")}
    assert set(rows) == set(found)
    for name, (_, kind, _, reliability, durability, depth, _) in rows.items():
        topic = found[name]
        expected = "tf2_msgs/msg/TFMessage" if topic.type is None else interface(topic.type)
        assert kind == expected, name
        assert topic.qos.reliability is RELIABILITY[reliability], name
        assert topic.qos.durability is DURABILITY[durability], name
        assert topic.qos.depth == int(depth), name
        assert topic.qos.history is HistoryPolicy.KEEP_LAST, name


def test_services() -> None:
    offered = {v for k, v in vars(services).items() if k.isupper() and isinstance(v, str)}
    assert {names_in(row[0])[0] for row in table("service")} == offered


def test_parameters_and_their_defaults() -> None:
    text = (ROOT / "config" / "nodes" / "drive_sim.yaml").read_text()
    defaults = yaml.safe_load(text)["/**"]["ros__parameters"]
    for name, value, _ in table("parameter"):
        assert float(value) == defaults[names_in(name)[0]]


def test_channels() -> None:
    of = {row[0]: tuple(names_in(row[1])) for row in table("of")}
    assert of["each"] == SPINDLE_CHANNELS
    balls, motor, sensor = of["two balls"], of["a motor"], of["a sensor `pickup`"]
    for deck_model, kind in (("a deck in the plane", Planar), ("a deck in space", InSpace)):
        readings = sensor[: kind.AXES]
        made = channels_for(kind.CHANNELS, 2, motor=True, readings=readings)
        assert made == (*of["each"], *of[deck_model], *balls, *motor, *readings)


def test_joints() -> None:
    from ab_msgs_py import JointSample

    message = JointSample(0, 0.0, 0.0, (0.0,) * 2, (0.0,) * 2, (0.0,) * 2).message()
    written = [name for row in table("`name`") for name in names_in(row[0])]
    assert written == list(message.name)


def test_faults() -> None:
    """Each kind is in the table, by an example that may be asked for."""
    shown = [fault for row in table("fault") for fault in names_in(row[0])]
    assert [fault.text for text in shown for fault in faults_of([text])] == shown
    assert {text.split()[1] for text in shown} == set(KINDS)


def test_files_it_links_to_are_there() -> None:
    for target in re.findall(r"\]\(([^)#:]+)\)", PAGE):
        assert (ROOT / "docs" / target).exists(), target
