"""Programs made up at random say as machine code what they say as Python."""

import importlib.util
import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.compiling.ways import same

HEAD = """
import math
from ab_sim.engine.compiling import Floats, Integers, fma

def twice(x: float, i: int) -> tuple[float, int]:
    return 2.0 * x, i // 2 % 7

def program(x: float, y: float, i: int, j: int, a: Floats, k: Integers) -> float:
    u, v, m, n, b = x, 1.0, i, 3, x > y
"""
TAIL = """
    return u + v + m - n if b else u - v + x * y
"""
FLOATS = ["x", "y", "u", "v", "a[0]", "a[m % 4]", "a[j % 4]", "0.1", "1.5", "-2.0"]
INTS = ["i", "j", "m", "n", "k[0]", "k[m % 3]", "2", "-7"]
OF_FLOATS = [
    "({0} + {1})",
    "({0} - {1})",
    "({0} * {1})",
    "({0} / (abs({1}) + 1.0))",
    "min({0}, {1})",
    "max({0}, {1}, {4})",
    "(-{0})",
    "abs({0})",
    "fma({0}, {1}, 0.25)",
    "math.sqrt(abs({0}))",
    "({0} if {2} else {1})",
    "({4} + {0})",
    "float({4})",
    "twice({0}, {4})[0]",
]
OF_INTS = [
    "({4} + {5})",
    "({4} - {5})",
    "({4} * ({5} % 10))",
    "({4} % 11 // 3)",
    "({4} // -3)",
    "({4} % -5)",
    "max({4}, {5})",
    "({4} if {2} else {5})",
    "int(min(max({0}, -1e6), 1e6))",
    "abs({4})",
    "twice({0}, {4})[1]",
]
OF_BOOLS = [
    "({0} < {1})",
    "({0} <= {1} < 2.5)",
    "({4} == {5})",
    "({4} != {5} > 1)",
    "({2} and {3})",
    "({2} or {3})",
    "(not {2})",
    "b",
]


def expressions(draw: Any, depth: int, which: str) -> str:
    """Of floats, ints or bools."""
    if depth == 0 and which != "b":
        return str(draw(st.sampled_from(FLOATS if which == "f" else INTS)))
    deeper = max(depth - 1, 0)
    form = draw(st.sampled_from({"f": OF_FLOATS, "i": OF_INTS, "b": OF_BOOLS}[which]))
    if depth == 0:
        form = "({0} < {1})"
    kinds = [("f", "f", "b", "b", "i", "i")[n] for n in range(6)]
    used = [n for n in range(6) if f"{{{n}}}" in form]
    parts = {n: expressions(draw, deeper, kinds[n]) for n in used}
    return str(form.format(*(parts.get(n, "") for n in range(6))))


def statements(draw: Any, depth: int, in_loop: bool, names: Any) -> list[str]:
    """Lines of a block."""
    lines: list[str] = []
    for _ in range(draw(st.integers(1, 3))):
        kinds = ["float", "int", "bool", "array", "add", "swap", "call"]
        if depth:
            kinds += ["if", "for", "while", "unrolled"] * 2
        if in_loop:
            kinds += ["leave"]
        kind = draw(st.sampled_from(kinds))
        f, i, b = (lambda w=which: expressions(draw, 2, w) for which in "fib")
        if kind == "float":
            lines.append(f"{draw(st.sampled_from('uv'))} = {f()}")
        elif kind == "int":
            lines.append(f"{draw(st.sampled_from('mn'))} = {i()} % 1000")
        elif kind == "bool":
            lines.append(f"b = {b()}")
        elif kind == "array":
            lines += [f"a[{i()} % 4] = {f()}", f"k[{i()} % 3] = {i()} % 1000"]
        elif kind == "add":
            lines += [f"u += {f()}", f"a[{i()} % 4] -= {f()}", f"m -= {i()} % 50"]
        elif kind == "swap":
            lines += ["u, v = v, u", "a[0], a[m % 4] = a[m % 4], a[0]"]
        elif kind == "call":
            lines.append(f"v, m = twice({f()}, {i()})")
        elif kind == "leave":
            way = draw(st.sampled_from(["break", "continue", f"return {f()}"]))
            lines.append(f"if {b()}:\n    {way}")
        else:
            own = next(names)
            inner = statements(draw, depth - 1, in_loop or kind != "if", names)
            step = draw(st.sampled_from([1, 2, -1]))
            head = {
                "if": f"if {b()}:",
                "for": f"for c{own} in range({i()} % 5, {i()} % 7, {step}):",
                "while": f"w{own} = 0\nwhile w{own} < 4 and {b()}:",
                "unrolled": f"for c{own} in (1, 3, {i()}):",
            }[kind]
            first = [f"w{own} += 1"] if kind == "while" else []
            if kind in ("for", "unrolled"):
                first = [f"u += 0.5 * c{own}"]
            block = "\n".join([*first, *inner]).replace("\n", "\n    ")
            lines.append(f"{head}\n    {block}")
            if kind == "if" and draw(st.booleans()):
                other = "\n".join(statements(draw, depth - 1, in_loop, names))
                other = other.replace("\n", "\n    ")
                lines.append(f"else:\n    {other}")
    return lines


@st.composite
def programs(draw: Any) -> str:
    body = "\n".join(statements(draw, 2, False, itertools.count()))
    return HEAD + "    " + body.replace("\n", "\n    ") + TAIL


numbers = st.floats(-1e3, 1e3) | st.sampled_from([0.0, -0.0, 1.0])
serial = itertools.count()


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@settings(max_examples=60, suppress_health_check=list(HealthCheck))
@given(programs(), numbers, numbers, st.integers(-99, 99), st.integers(-9, 9))
def test_any_program(tmp_path_factory: Any, text: str, x: float, y: float, i: int, j: int) -> None:
    path: Path = tmp_path_factory.mktemp("program") / f"program_{next(serial)}.py"
    path.write_text(text, encoding="utf-8")
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    a, k = np.array([x, y, 0.5, -1.0]), np.array([i, j, 3])
    same(module.program, x, y, i, j, a, k)
