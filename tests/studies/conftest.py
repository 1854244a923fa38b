"""What tests of studies share: a folder of results of their own, and nothing kept elsewhere."""

from tests.analysis.maps.conftest import own_results

__all__ = ["own_results"]
