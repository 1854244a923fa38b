"""Scenes with a requested accuracy, short enough for the independent simulator."""

from typing import Any

from ab_sim.scene import Scene, check_scene, load_scene
from tests.conftest import THESIS, merge

SHORT = {
    # Through the resonance, from close to it: an independent simulator takes its time.
    "thesis-hold": ["start.speed=80", "duration=0.7"],
    "thesis-baseline": ["start.speed=80", "duration=0.7"],
    "one-ball": ["start.speed=80", "duration=0.7"],
    "no-ball": ["start.speed=80", "duration=0.7"],
    "balanced-start-up": ["start.speed=80", "duration=0.5"],
    "weak-motor": ["duration=0.6"],
    "five-balls-8000-rpm": ["start.speed=220", "duration=0.3"],
    "on-edge": ["start.speed=80", "duration=0.4"],
    "everything": ["duration=0.3"],
    "nsc-case-1": ["profile.start_time=0.1", "duration=0.3"],
    "nsc-case-2": ["profile.start_time=0.1", "duration=0.3"],
    "nsc-case-3": ["profile.start_time=0.1", "duration=0.3"],
    # With eight balls at rest the reference has 10^7 modes to choose from: see the last of these
    # tests. Three in a row start to slide, meet and part.
    "packed-balls": ["balls.count=3", "duration=0.5"],
    "feeding-deck": ["start.deck.tilt=[0.01,0.02,0.03]", "race.height=0.01", "duration=0.15"],
    # Through the tilt's critical speed.
    "couple-unbalance": ["start.speed=350", "profile.acceleration=400", "duration=0.1"],
}
MEETING = ["balls.count=2", "balls.mass=0.001", "effects.viscous_drag.coefficient=0.02"]
MEETING += ["start.ball_angles=[0.6,-0.6]"]
EVENTFUL = {
    "balls that stick": (
        "thesis-hold",
        ["start.speed=60", "start.ball_angles=[0.5,-1.1]", "effects.rolling_friction.arm=5e-6"]
        + ["effects.viscous_drag.coefficient=0.1", "duration=0.6"],
        {"stick", "release"},
    ),
    "balls that collide": (
        "packed-balls",
        [*MEETING, "effects.rolling_friction.arm=0", "start.speed=90", "duration=0.4"],
        {"impact"},
    ),
    "balls that stick and collide": (
        "packed-balls",
        [*MEETING, "effects.rolling_friction.arm=5e-6", "start.speed=60", "duration=0.6"],
        {"stick", "release", "impact"},
    ),
}
"""Scene, changes, and events that the reference must have, by name of the case.

The code that measures an accuracy shares its laws and its event location with the code under
test. These scenes compare both with the reference. They use the sets of effects of the scenes
above.
"""
NEW: dict[str, Any] = merge(
    THESIS,
    {
        "rotor": {"total_mass": 0.13, "eccentricity": 7e-5},
        "race": {"radius": 0.013},
        "balls": {"count": 3, "mass": [6e-4, 1.1e-3, 9e-4], "radius": 1.2e-3},
        "effects": {
            "suspension": {"stiffness": 2100.0, "damping": 0.5},
            "viscous_drag": {"coefficient": 0.35},
            "gravity": {"tilt": 0.4, "direction": 0.7},
        },
        "start": {"speed": 90.0, "ball_angles": [0.4, 2.0, -1.7]},
        "profile": {"kind": "start_up", "acceleration": 90.0, "target_speed": 180.0},
        "solver": None,
        "duration": 0.9,
    },
)
"""Drive with values that no method was tuned on."""


def wished(name: str, **accuracy: float) -> Scene:
    if name == "new":
        return check_scene({**NEW, "accuracy": accuracy}, "new")
    scene, changes, _ = EVENTFUL[name] if name in EVENTFUL else (name, SHORT[name], set())
    return load_scene(scene, [*changes, *(f"accuracy.{k}={v!r}" for k, v in accuracy.items())])
