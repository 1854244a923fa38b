"""A state that was recorded begins another run, which goes on as the first one did."""

import numpy as np
import pytest

from ab_sim.analysis.replay import start_from
from ab_sim.base.errors import InputError
from ab_sim.drive import Drive
from ab_sim.scene import load_scene
from ab_sim.scene.load import changed_scene

SHORT = "profile={kind: start_up, acceleration: 40.0, target_speed: 60.0}"


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("thesis-hold", ["effects.rolling_friction=", SHORT]),
        (
            "feeding-deck",
            ["start.deck.tilt=[0.01,-0.02,0.03]", "start.deck.tilt_rate=[0.5,0.2,-0.3]"],
        ),
    ],
)
def test_it_goes_on_as_it_did(name: str, changes: list[str]) -> None:
    scene = load_scene(name, changes)
    drive = Drive(scene)
    last = drive.advance(2000).last(1)
    drive.advance(1)  # a kink of the profile is behind it
    sample = dict(zip(last.channels, last.samples[0].tolist(), strict=True))
    start = start_from(sample, scene.balls.count, scene.deck is not None)
    held = {"profile": None} if scene.profile is not None else {}
    again = Drive(
        changed_scene(scene, held | {f"start.{k}": v for k, v in start.items()}, "recorded")
    )
    one, other = drive.advance(300), again.advance(301)
    for channel in (name for name in one.channels if name not in ("step", "time", "command")):
        size = max(np.abs(one[channel]).max(), 1e-6)
        np.testing.assert_allclose(
            other[channel][1:], one[channel], rtol=0, atol=1e-8 * size, err_msg=channel
        )


def test_what_a_sample_lacks_is_named() -> None:
    with pytest.raises(InputError, match="lacks speed, vy, ball_0_angle, ball_0_rate"):
        start_from({"angle": 0.0, "x": 0.0, "y": 0.0, "vx": 0.0, "vy": np.nan}, 1, False)
