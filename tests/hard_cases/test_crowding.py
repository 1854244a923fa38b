"""Several balls that come to rest, or part, at one time: decided at once, none unresolved.

Before, of five balls on the way to rest one was changed after the other, until the step's events
were used up: 34 times within these 200 s.
"""

import numpy as np

from ab_sim.drive import Drive
from ab_sim.model.dynamics.system import has_events
from ab_sim.scene import load_scene, scene_names
from tests.overlap import assert_apart


def test_five_balls_that_come_to_rest_together() -> None:
    drive = Drive(load_scene("five-balls-8000-rpm"), commanded=True)
    for k in range(400):
        drive.command(300.0 + 100.0 * np.sin(0.2 * k))
        drive.advance(round(0.5 / drive.step))
    assert drive.steps_with_unresolved_events == 0
    assert drive.events > 100


def test_no_scene_that_ships_is_crowded_under_random_commands() -> None:
    """A few of the 10,000 that benchmarks/random_commands.py tries."""
    rng = np.random.default_rng(3)
    events = {}
    for name in scene_names():
        scene = load_scene(name)
        if not has_events(tuple(scene.effects.values())):
            continue
        drive = Drive(scene, commanded=True)
        for _ in range(12):
            drive.command(rng.uniform(-1.0, 1.0) * scene.spindle.max_speed)
            assert_apart(drive, drive.advance(round(rng.uniform(0.01, 0.4) / drive.step)))
        assert drive.steps_with_unresolved_events == 0, name
        events[name] = drive.events
    assert events["packed-balls"] > 10 and events["on-edge"] > 10, "there were events to crowd"
