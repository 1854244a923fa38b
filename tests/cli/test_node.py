"""`ab-sim node`: what can be asked, and what is refused before anybody is asked."""

from typing import Any

import pytest

from ab_sim.base.errors import InputError
from ab_sim.cli.node import parameter_values, value_of
from ab_sim.cli.node_commands import SERVICES
from tests.cli.tool import ab_sim, refused
from tests.domains import own_domain

NAMES = {each.name: each for each in SERVICES}


def test_every_service_of_the_contract_can_be_asked_for() -> None:
    pytest.importorskip("rclpy", reason="needs ROS 2")
    from ab_msgs_py import services

    offered = {v for k, v in vars(services).items() if k.isupper() and isinstance(v, str)}
    assert {f"~/{each.service_name}" for each in SERVICES} == offered, (
        "each wants a row in node_services.py"
    )


def test_words_become_parameters(monkeypatch: pytest.MonkeyPatch, tmp_path: Any) -> None:
    monkeypatch.chdir(tmp_path)
    for name, words, values in (
        ("step", {"steps": None}, {}),
        ("step", {"steps": "5"}, {"steps": 5}),
        ("save", {"snapshot": "kept.json"}, {"snapshot": str(tmp_path / "kept.json")}),
        (
            "load-scene",
            {"scene": "thesis-hold", "changes": None},
            {"scene": "thesis-hold", "changes": [""]},
        ),
        (
            "load-scene",
            {"scene": "mine.yaml", "changes": ["balls.mass=0.002", "profile="]},
            {"scene": str(tmp_path / "mine.yaml"), "changes": ["balls.mass=0.002", "profile="]},
        ),
        (
            "load-disc",
            {"disc_eccentricity": "1e-4", "disc_angle": "-0.5"},
            {"disc_eccentricity": 1e-4, "disc_angle": -0.5},
        ),
        (
            "load-disc",
            {"disc_eccentricity": "1e-4", "disc_angle": None},
            {"disc_eccentricity": 1e-4, "disc_angle": 0.0},
        ),
        ("pause", {}, {}),
    ):
        assert parameter_values(NAMES[name], words) == values, name


def test_values_of_parameters() -> None:
    words = ("1e-4", "-2.5E3", "7", "7.0", "true", "paced", "'7'", "[a=1, b=2]", "", "''")
    values = [1e-4, -2500.0, 7, 7.0, True, "paced", "7", ["a=1", "b=2"], None, ""]
    assert [value_of(word) for word in words] == values
    assert value_of("{kind: adaptive, sensor: imu}") == "{kind: adaptive, sensor: imu}"


def test_a_slip_in_an_option_is_no_word() -> None:
    with pytest.raises(InputError, match="--nmae: .* no such option"):
        parameter_values(NAMES["save"], {"snapshot": "--nmae"})


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("step", "many"), "'many': must be a whole number"),
        (("load-disc", "big"), "'big': must be a number"),
        (("load-scene",), "Missing argument 'SCENE'"),
        (("pause", "now"), "unexpected extra argument"),
        (("pause", "--namespace", "le ft"), "--namespace le ft: must be words between slashes"),
        (("pause", "--node", "/left/drive_sim"), "give the part before it with --namespace"),
        (("pause", "--wait", "nan"), "--wait nan: must be more than 0 s and finite"),
        (("set", "speed_factor"), "'speed_factor': must be NAME=VALUE"),
        (("set", "a=1", "a=2"), "a: is given twice"),
        (("set", "a={"), "the value is not valid YAML"),
        (("command", "fast"), "SPEED 'fast': must be a number, in rad/s or with a unit"),
        (("command", "2 kg"), "SPEED '2 kg': is a mass [kg], must be an angular speed [rad/s]"),
        (("command", "inf"), "SPEED inf: must be a finite number"),
        (("command", "--sped"), "--sped: `ab-sim node command` has no such option"),
        (("list", "--wait", "0"), "--wait 0: must be more than 0 s"),
        (("puase",), "No such command 'puase'"),
    ],
)
def test_bad_input(arguments: tuple[str, ...], words: str) -> None:
    assert words in refused("node", *arguments)


@pytest.mark.ros
def test_nobody_there() -> None:
    pytest.importorskip("rclpy", reason="needs ROS 2")
    done = ab_sim("node", "pause", "--namespace", "nowhere", "--wait", "0.3")
    assert done.returncode == 2
    assert "no node offers /nowhere/drive_sim/pause (waited 0.3 s)" in done.stderr
    done = ab_sim("node", "command", "5", "--namespace", "nowhere", "--wait", "0.3")
    assert done.returncode == 2
    assert "there is no drive /nowhere/drive_sim (waited 0.3 s)" in done.stderr


@pytest.mark.ros
def test_a_list_of_nobody_waits_for_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    """It ends at all, though it may wait for days."""
    pytest.importorskip("rclpy", reason="needs ROS 2")
    with own_domain() as domain:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
        monkeypatch.delenv("ROS_AUTOMATIC_DISCOVERY_RANGE", raising=False)
        done = ab_sim("node", "list", "--wait", "1e6")
    assert done.returncode == 2
    assert f"there is no node at all on ROS_DOMAIN_ID {domain}" in done.stderr
