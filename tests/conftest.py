"""Fixtures and settings for all tests."""

import signal
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from matplotlib.figure import Figure

from ab_sim.scene import Scene, check_scene

# Rewrite the assertions of these helpers, too; this must come before their first import.
pytest.register_assert_rewrite("tests.effects", "tests.nodes.fleet", "tests.overlap")

# By default, Hypothesis limits each example to 0.2 s, and the generation of the first examples to a
# few seconds, by the wall clock. On a busy machine, tests would fail at random.
settings.register_profile(
    "by no clock", deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("by no clock")

# nohup ignores SIGHUP, and child processes inherit ignored signals. They do not inherit handlers,
# so an empty handler restores the default for them.
if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, lambda *_: None)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run long tests first, so that no worker is left with one at the end."""
    items.sort(key=lambda item: item.get_closest_marker("long") is None)


SceneMaker = Callable[..., Scene]


def merge(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """Return ``base`` updated with ``changes``, section by section; None removes a key."""
    merged = dict(base)
    for key, value in changes.items():
        if value is None:
            merged.pop(key, None)
        elif isinstance(value, dict) and isinstance(merged.get(key), dict) and key != "profile":
            merged[key] = merge(merged[key], value)
        else:
            merged[key] = value
    return merged


THESIS: dict[str, Any] = {
    "rotor": {"total_mass": 0.1, "eccentricity": 1e-4},
    "race": {"radius": 0.01},
    "balls": {"count": 2, "mass": 1e-3, "radius": 1e-3},
    "effects": {
        "suspension": {"stiffness": 1000.0, "damping": 0.2},
        "viscous_drag": {"coefficient": 1.0},
        "spindle_acceleration": {},
        "ball_spin": {},
    },
    "start": {"speed": 0.0},
    "spindle": {"max_speed": 500.0, "max_acceleration": 100.0},
    "profile": {"kind": "start_up", "acceleration": 40.0, "target_speed": 400.0},
    "solver": {"stepper": "rk8", "step": 0.001},
    "duration": 6.0,
}
"""Drive of the thesis without friction, accelerating for six seconds."""

MOTOR = {
    "rotor_inertia": 2e-5,
    "torque_limit": 1e-2,
    "proportional_gain": 1e-3,
    "integral_gain": 1e-2,
    "back_emf_slope": 1e-6,
}
"""Motor for that drive."""

ProfileMaker = Callable[..., dict[str, Any]]


@pytest.fixture
def with_hold() -> ProfileMaker:
    """Return a function for a start-up with a variable-speed period, by default constant speed."""

    def make(target_speed: float = 400.0, **period: float) -> dict[str, Any]:
        return {
            **THESIS["profile"],
            "target_speed": target_speed,
            "variable_speed_period": {"acceleration": 0.0, **period},
        }

    return make


@pytest.fixture
def scene() -> SceneMaker:
    """Return a function for the thesis' scene without friction, with nested changes."""

    def make(**changes: Any) -> Scene:
        merged = merge(THESIS, changes)
        if "ball_contact" not in merged["effects"]:  # tests expect balls that start at 0
            at_zero = {"ball_angles": [0.0] * merged["balls"]["count"]}
            merged["start"] = {**at_zero, **merged.get("start", {})}
        return check_scene(merged, "test")

    return make


@pytest.fixture
def domain() -> Iterator[int]:
    """Yield a DDS domain that no other test uses."""
    from tests.domains import own_domain  # it imports fcntl, which Windows lacks

    with own_domain() as number:
        yield number


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """Return the list of figures that are saved, for tests of their contents."""
    figures: list[Figure] = []
    write = Figure.savefig

    def keep(figure: Figure, *args: Any, **options: Any) -> None:
        write(figure, *args, **options)
        figures.append(figure)

    monkeypatch.setattr(Figure, "savefig", keep)
    return figures
