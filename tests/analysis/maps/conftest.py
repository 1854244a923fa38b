"""What tests of maps share: a folder of results of their own, and nothing kept elsewhere."""

from pathlib import Path

import pytest

from ab_sim.analysis import results


@pytest.fixture(autouse=True)
def own_results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(results, "results_folder", lambda: tmp_path)
    return tmp_path
