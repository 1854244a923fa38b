"""Fixtures for nodes, as in ``tests/nodes``."""

from tests.nodes.conftest import fleet

__all__ = ["fleet"]
