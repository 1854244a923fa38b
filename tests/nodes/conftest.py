"""Fixtures for nodes: a fleet for each test, on a separate DDS domain."""

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
    """Hide the screen; use it before the fleet, which passes its environment on."""
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"):
        monkeypatch.delenv(name, raising=False)
