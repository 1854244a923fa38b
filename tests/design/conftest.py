"""Fixture for tests of sweeps: a separate folder for results."""

from pathlib import Path

import pytest

from ab_sim.analysis import result_cache


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder for results."""
    home = tmp_path / "kept"
    home.mkdir()
    monkeypatch.setattr(result_cache, "results_folder", lambda: home)
    return home
