"""Sweeps keep what is done in a folder of the test's own."""

from pathlib import Path

import pytest

from ab_sim.analysis import results


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where they keep it."""
    home = tmp_path / "kept"
    home.mkdir()
    monkeypatch.setattr(results, "results_folder", lambda: home)
    return home
