"""Fixture for tests of maps: a separate folder of results, so that no cached results are used."""

from pathlib import Path

import pytest

from ab_sim.analysis import result_cache


@pytest.fixture(autouse=True)
def own_results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(result_cache, "results_folder", lambda: tmp_path)
    return tmp_path
