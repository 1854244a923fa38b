"""A fleet of nodes per test, each on a DDS domain of its own."""

from collections.abc import Iterator
from pathlib import Path

import pytest


@pytest.fixture
def fleet(domain: int, tmp_path: Path) -> Iterator["Fleet"]:  # noqa: F821
    pytest.importorskip("rclpy", reason="needs ROS 2")
    from tests.nodes.fleet import Fleet

    made = Fleet(domain, tmp_path)
    yield made
    made.close()


@pytest.fixture
def no_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    """As on a machine without; before the fleet, which hands its environment on."""
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"):
        monkeypatch.delenv(name, raising=False)
