"""``docs/topics.md`` says what the code does."""

import re
from pathlib import Path

import pytest
import yaml

pytest.importorskip("rclpy", reason="needs ROS 2")

from ab_msgs_py import JointSample, services, topics  # noqa: E402
from ab_sim.base.sample_columns import SPINDLE_CHANNELS  # noqa: E402
from ab_sim.drive.faults.fault import KINDS, faults_of  # noqa: E402
from ab_sim.drive.trajectory import channels_for  # noqa: E402
from ab_sim.model.equations.in_space import InSpace  # noqa: E402
from ab_sim.model.equations.planar import Planar  # noqa: E402

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "topics.md").read_text()


def table(first_column: str) -> list[list[str]]:
    """The cells of the table whose first column has this name."""
    _, _, rest = PAGE.partition(f"\n| {first_column} |")
    assert rest, f"no table of {first_column}"
    rows = rest.partition("\n\n")[0].splitlines()[2:]
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]


def names_in(cell: str) -> list[str]:
    return re.findall(r"`([^`]+)`", cell)


def test_topics() -> None:
    """Who reads the file has the table that the site makes anew."""
    made = "\n".join(["<!-- from code: topics -->", "", *topics.table(), "", "<!-- to here -->"])
    assert made in PAGE, f"put this into the page:\n{made}"


def test_every_topic_is_in_it() -> None:
    """What is a topic of the module is one of the contract, declared once."""
    named = [each for each in vars(topics).values() if isinstance(each, topics.Topic)]
    assert named == topics.ALL and len({topic.name for topic in named}) == len(named)


def test_services() -> None:
    offered = {v for k, v in vars(services).items() if k.isupper() and isinstance(v, str)}
    assert {names_in(row[0])[0] for row in table("service")} == offered


def test_parameters_and_their_defaults() -> None:
    text = (ROOT / "config" / "nodes" / "drive_sim.yaml").read_text()
    defaults = yaml.safe_load(text)["/**"]["ros__parameters"]
    for name, value, _ in table("parameter"):
        assert float(value) == defaults[names_in(name)[0]]


def test_channels() -> None:
    of = {row[0]: tuple(names_in(row[1])) for row in table("part of the scene")}
    assert of["every scene"] == SPINDLE_CHANNELS
    balls, motor, sensor = of["two balls"], of["a motor"], of["a sensor `pickup`"]
    for deck_model, kind in (("a deck in the plane", Planar), ("a deck in space", InSpace)):
        readings = sensor[: kind.AXES]
        made = channels_for(kind.CHANNELS, 2, motor=True, readings=readings)
        assert made == (*of["every scene"], *of[deck_model], *balls, *motor, *readings)


def test_joints() -> None:
    fields = JointSample(0, 0.0, 0.0, (0.0,) * 2, (0.0,) * 2, (0.0,) * 2).fields()
    written = [name for row in table("`name`") for name in names_in(row[0])]
    assert written == fields["name"]


def test_faults() -> None:
    """Each kind is in the table, by an example that may be asked for."""
    shown = [fault for row in table("fault") for fault in names_in(row[0])]
    assert [fault.text for text in shown for fault in faults_of([text])] == shown
    assert {text.split()[1] for text in shown} == set(KINDS)
