"""Nodes of a test, as in ``tests/nodes``."""

from tests.nodes.conftest import fleet

__all__ = ["fleet"]
