"""Nodes of a test, as in ``tests/nodes``."""

from tests.nodes.conftest import domain, fleet

__all__ = ["domain", "fleet"]
