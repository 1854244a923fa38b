"""Fixture for tests of studies: a separate folder of results, so that no cached ones are used."""

from tests.analysis.maps.conftest import own_results

__all__ = ["own_results"]
