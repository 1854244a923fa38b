"""The notebook that designs a balancer shows what its cells compute."""

import copy
import importlib.util
import json
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
NOTEBOOK = ROOT / "examples" / "design_a_balancer" / "design_a_balancer.ipynb"


@pytest.fixture(scope="module")
def runner() -> Any:
    spec = importlib.util.spec_from_file_location("run_notebook", ROOT / "tools/run_notebook.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def code_cell(source: str) -> dict[str, Any]:
    return {"cell_type": "code", "source": source.splitlines(keepends=True), "outputs": []}


def texts(cells: list[dict[str, Any]]) -> list[str]:
    return [
        "".join(output["text"])
        for cell in cells
        for output in cell.get("outputs", [])
        if output["output_type"] == "stream"
    ]


def pictures(cells: list[dict[str, Any]]) -> int:
    return sum("image/png" in o.get("data", {}) for c in cells for o in c.get("outputs", []))


def test_stored_results_are_current(runner: Any) -> None:
    """After a change run ``tools/run_notebook.py`` again."""
    stored = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    cells = copy.deepcopy(stored)
    runner.run(cells)
    assert len(texts(stored)) == 5
    assert texts(cells) == texts(stored)
    assert pictures(cells) == pictures(stored) == 1


def test_values_errors_and_names_between_cells(runner: Any) -> None:
    cells = [code_cell("a = 20\nprint('set')"), {"cell_type": "markdown"}, code_cell("a + 1")]
    runner.run(cells)
    assert texts(cells) == ["set\n"]
    assert cells[2]["outputs"][0]["data"] == {"text/plain": ["21"]}
    assert [cells[0]["execution_count"], cells[2]["execution_count"]] == [1, 2]
    with pytest.raises(ZeroDivisionError):
        runner.run([code_cell("1 / 0")])
