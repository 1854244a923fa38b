"""The page on many machines has the figures that were measured."""

import importlib
import json
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def test_the_page_is_made_of_what_was_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    page = importlib.import_module("scaling_page").page
    report = json.loads((ROOT / "docs" / "scale.json").read_text())
    assert page(report) == (ROOT / "docs" / "scale.md").read_text()
