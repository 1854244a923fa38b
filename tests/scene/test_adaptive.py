"""What a scene says of an adaptive start-up, and what is refused of it."""

from typing import Any

import pytest

from ab_sim.base.errors import SceneError
from ab_sim.model.spindle import SpeedSchedule, top_speed_of
from ab_sim.scene.profiles import StartUpProfile, planned
from tests.conftest import SceneMaker

ADAPTIVE = {"kind": "adaptive", "acceleration": 40.0, "target_speed": 400.0, "sensor": "pick_up"}
SENSORS: dict[str, Any] = {"pick_up": {}}


def test_it_is_read(scene: SceneMaker) -> None:
    made = scene(profile=ADAPTIVE, sensors=SENSORS)
    assert made.profile is not None and made.profile.kind == "adaptive"
    assert made.profile.steps_per_command(made.solver.step) == 5
    assert top_speed_of(made) == 400.0
    assert planned(made.profile) == StartUpProfile(
        kind="start_up", acceleration=40.0, target_speed=400.0
    )


@pytest.mark.parametrize(
    ("profile", "others", "words"),
    [
        ({"sensor": "pickup"}, {}, "profile.sensor = 'pickup': .*pick_up"),
        ({}, {"sensors": {}}, r"no sensor; .*sensors: \{pick_up: \{\}\}"),
        ({"sensor": "Pick"}, {}, "profile.sensor = 'Pick': .*small letters"),
        ({"target_speed": 501.0}, {}, "profile.target_speed = 501 rad/s: is beyond spindle.max_sp"),
        ({"target_speed": 0.5}, {}, "final_speed = 0.5: must be from 1 to"),
        ({"acceleration": 101.0}, {}, "profile.acceleration = 101 rad/s.2: is more than"),
        ({"command_period": 0.0052}, {}, "profile.command_period = 0.0052 s: .*0.005 and 0.006 s"),
        ({"command_period": 0.0005}, {}, "profile.command_period = 0.0005 s: .*nearest: 0.001 s"),
        ({"command_period": float("nan")}, {}, "profile.command_period = nan"),
        ({}, {"start": {"speed": -1.0}}, "start.speed = -1 rad/s: .*between 0 and"),
        ({}, {"start": {"speed": 401.0}}, "start.speed = 401 rad/s: .* profile.target_speed = 400"),
        (
            {},
            {"sensors": {"pick_up": {"sample_rate": 250.0}}},
            "sample_rate of pick_up = 250 Hz: .* 254.6 Hz",
        ),
    ],
)
def test_what_makes_no_sense_is_refused(
    scene: SceneMaker, profile: dict[str, Any], others: dict[str, Any], words: str
) -> None:
    changes = {"sensors": SENSORS, "profile": {**ADAPTIVE, **profile}, **others}
    with pytest.raises(SceneError, match=words):
        scene(**changes)


def test_there_is_no_speed_over_time_before_the_run(scene: SceneMaker) -> None:
    with pytest.raises(SceneError, match="profile.kind = adaptive: "):
        SpeedSchedule.of_scene(scene(profile=ADAPTIVE, sensors=SENSORS))
