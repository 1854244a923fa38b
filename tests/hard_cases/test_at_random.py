"""Whatever comes: friction, gravity, contact and drag at random sizes, zeros among them.

Asserted for each: finite, energy balances and is never made by losses, balls do not overlap, no
step has more events than could be located.
"""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.hard_cases.extremes import RUBBING, imbalance, run, scene_of

sizes = st.one_of(st.just(0.0), st.floats(1e-9, 1.0))


@settings(max_examples=25, derandomize=True)
@given(
    friction=sizes,
    restitution=sizes,
    tilt=st.floats(-1.6, 1.6),
    drag=sizes,
    speed=st.floats(-300.0, 300.0),
    places=st.lists(st.floats(0.0, 1.0), min_size=3, max_size=3),
)
def test_anything(
    friction: float,
    restitution: float,
    tilt: float,
    drag: float,
    speed: float,
    places: list[float],
) -> None:
    effects = {
        **RUBBING,
        "rolling_friction": {"arm": friction * 1e-3},
        "ball_contact": {"restitution_coefficient": restitution},
        "gravity": {"tilt": tilt},
        "viscous_drag": {"coefficient": drag},
    }
    # A third of the race for each ball, less the room that it needs.
    angles = [2 * np.pi / 3 * i + 1.8 * place for i, place in enumerate(places)]
    drive = run(
        scene_of(
            balls={"count": 3},
            effects=effects,
            start={"speed": speed, "ball_angles": angles},
            profile=None,
            solver={"step": 2.5e-4},
        ),
        0.05,
    )
    now = drive.observe()
    apart = np.diff([*now.theta, now.theta[0] + 2 * np.pi])
    assert apart.min() > 2 * np.arcsin(0.1) - 1e-8
    assert drive.energy().dissipated >= 0.0
    assert imbalance(drive) < 1e-8
