"""Where a function's source ends, and on which line of its file an error is."""

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ab_sim.engine.compiling import Compiled, Untranslatable

TEXT = """\
from ab_sim.engine.compiling import Floats


def total(
    values: Floats,
    factor: float,
) -> float:
    found = 0.0
# A comment that is further to the left ends nothing,
    '''
nor do strings,
'''
    half = (
0.5 * factor
)   # nor brackets.

    for x in range(values.size):
        found += values[x] * half
    return found


class Within:
    @staticmethod
    def doubled(x: float) -> float:
        return 2.0 * x

    @staticmethod
    def faulty(x: float) -> float:
        y = 2.0 * x
        return [y]
"""


@pytest.fixture
def module(tmp_path: Path) -> Any:
    path = tmp_path / "written.py"
    path.write_text(TEXT)
    spec = importlib.util.spec_from_file_location("written", path)
    assert spec and spec.loader
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


def test_a_function_ends_where_another_statement_may_begin(module: Any) -> None:
    values = np.array([1.0, 2.0, 4.0])
    assert Compiled(module.total)(values, 3.0) == module.total(values, 3.0) == 10.5


def test_a_function_may_be_indented(module: Any) -> None:
    assert Compiled(module.Within.doubled)(1.5) == 3.0


def test_an_error_names_the_line_of_the_file(module: Any) -> None:
    line = TEXT[: TEXT.index("return [y]")].count("\n") + 1
    with pytest.raises(Untranslatable, match=rf"written.py:{line}: in Within.faulty: "):
        Compiled(module.Within.faulty)(1.5)
