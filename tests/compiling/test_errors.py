"""What is not in the subset is told: where it is, what it is, and what to write instead."""

import importlib.util
import re
import textwrap
from pathlib import Path
from typing import Any

import pytest

from ab_sim.engine.compiling import Untranslatable, compiled

HEAD = """
import math
from typing import NamedTuple
import numpy as np
from ab_sim.engine.compiling import Floats, IntegerTable, Table, call, fma, scratch

class Pair(NamedTuple):
    low: float
    values: Floats

class Odd(NamedTuple):
    what: list

WORDS = {"a": 1}
NUMBERS = np.zeros(3)
TOO_LOW = -(2**63) - 1

def other(x: float, n: int) -> float:
    return x

def silent(x: float) -> None:
    pass

def with_default(x: float = 1.0) -> float:
    return x
"""
CASES = [
    # Line of the body that is at fault, what is said, and what is said to write instead.
    ("try:\n    x = 1.0\nfinally:\n    pass", 1, "statement 'try:'", "see ab_sim.engine.compiling"),
    ("y = 1.0\nraise ValueError", 2, "statement 'raise ValueError'", ""),
    ("y = [x, x]", 1, "'[x, x]' is not in the subset", "use a tuple, or scratch(n)"),
    ("y = max(x for _ in range(3))", 1, "is not in the subset", "write a loop"),
    ("y = (lambda: 1.0)()", 1, "call of", "functions of the subset"),
    ("y = f'{x}'", 1, "is not in the subset", "leave texts to the caller"),
    ("n = 1\nn = 2.5", 2, "n, from its first assignment on, is int, this is float", "0.0"),
    ("n = 1\nn += x", 2, "n, from its first assignment on, is int", "begin with a float"),
    ("b = x > 1.0\nb = 1", 2, "is bool, this is int", "write a comparison"),
    ("y = a\ny = x", 2, "is 1-D array of floats, this is float", "use another name"),
    ("y = nowhere", 1, "nowhere is not known here", "assign to it on a line above"),
    ("y = WORDS", 1, "WORDS is a dict", "pass anything else as an argument"),
    ("y = NUMBERS[0]", 1, "NUMBERS is a ndarray", "pass anything else as an argument"),
    ("y = a[0.5]", 1, "index 0.5 is a float", "write int(...)"),
    ("y = a[-1]", 1, "negative index", "a[a.size - 1]"),
    ("y = a[0, 1]", 1, "2 indices of a 1-D array of floats", "use fewer"),
    ("y = t[:, 0]", 1, "not contiguous", "slice the last index"),
    ("y = a[::2]", 1, "not contiguous", "slice the last index"),
    ("a[:] = 1.0", 1, "assignment to a[:]", "in a loop"),
    ("y = a + 1.0", 1, "a is a 1-D array of floats, not a number", "in a loop"),
    ("k[0, 0] = x", 1, "the array's element is int, this is float", "write int(...)"),
    ("y = a.T", 1, ".T of a 1-D array", ".size and .shape"),
    ("y = p.high", 1, "Pair has no high", "its fields are low, values"),
    ("p.low = 1.0", 1, "assignment to p.low", "make a new one"),
    ("for v in a:\n    pass", 1, "loop over a 1-D array", "for i in range(...)"),
    ("for i in range(0, 9, int(x)):\n    pass", 1, "range with this step", "constant"),
    ("for i in range(x):\n    pass", 1, "range of a number that is no int", "write int(...)"),
    ("for i in range(3):\n    pass\nelse:\n    pass", 1, "else of a loop", "use a variable"),
    ("y = x and a[0] > 1.0", 1, "float in 'and' or 'or'", "write a comparison"),
    ("y = x in (1.0, 2.0)", 1, "'x in (1.0, 2.0)'", "write =="),
    ("y = x ** 2", 1, "Pow of floats", "for the subset"),
    ("y = x % 2.0", 1, "Mod of floats", "for the subset"),
    ("y = +x", 1, "'+x' is not in the subset", "-x"),
    ("y: float = 1", 1, "statement 'y: float = 1'", ""),
    ("y = 1 if x > 0.0 else x", 1, "the other branch is int, this is float", "0.0"),
    ("y = x << 1", 1, "LShift of floats", ""),
    ("y = 9223372036854775808", 1, "more than 64 bits", "below 2**63"),
    ("y = TOO_LOW", 1, "more than 64 bits", "below 2**63"),
    ("y = math.gamma(x)", 1, "call of math.gamma", "listed in ab_sim.engine.compiling"),
    ("y = np.sin(x)", 1, "call of np.sin", "functions of the subset"),
    ("y = other(x)", 1, "other takes 2 arguments: x, n", "pass each one once"),
    ("y = other(x, 1, 2)", 1, "this passes 3", "pass each one once"),
    ("y = other(x, n=1)", 1, "arguments by name", "by place"),
    ("y = other(x, x)", 1, "n of other is int, this is float", "write int(...)"),
    ("y = other(*p)", 1, "with *", "one by one"),
    ("y = silent(x)", 1, "without a result is used as a value", "call it by itself"),
    ("y = with_default()", 1, "a default", "pass every argument"),
    ("y = Pair(x)", 1, "Pair takes 2 arguments: low, values", "pass each one once"),
    ("y = Odd(x)", 1, "a field of Odd", "annotate"),
    ("y = min(x)", 1, "1 arguments of min", "pass 2"),
    ("y = min(a, x)", 1, "a is a 1-D array", ""),
    ("y = fma(x, x, c=x)", 1, "arguments by name", "by place"),
    (
        "for i in range(3):\n    y = scratch(int(x))",
        2,
        "run-time size in a loop",
        "out of the loop",
    ),
    (
        "for i in range(3):\n    for j in range(2):\n        pass\n    y = scratch(int(x))",
        4,
        "run-time size in a loop",
        "out of the loop",
    ),
    ("call(x, a)", 1, "call", "an address first"),
    ("call(5, p)", 1, "p goes to emitted code", "arrays, floats and ints"),
    ("y, z = x, x, x", 1, "tuple[float, float, float] in (y, z)", ""),
    ("x > 1.0", 1, "by itself", "leave it out"),
    ("return 1.5, 2.5", 1, "the result is float", ""),
    ("return", 1, "return", "what the annotation says"),
    ("def inner() -> None:\n    pass", 1, "statement 'def inner() -> None:'", ""),
]


def made(tmp_path: Path, text: str) -> Any:
    path = tmp_path / "example.py"
    path.write_text(HEAD + text)
    spec = importlib.util.spec_from_file_location("example", path)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("body, line, what, instead", CASES)
def test_errors(tmp_path: Path, body: str, line: int, what: str, instead: str) -> None:
    text = "def faulty(x: float, a: Floats, t: Table, k: IntegerTable, p: Pair) -> float:\n"
    text += textwrap.indent(body, "    ") + "\n    return 0.0\n"
    module = made(tmp_path, text)
    with pytest.raises(Untranslatable) as error:
        compiled(module.faulty).bind(0.0)
    message = str(error.value)
    if "with_default" not in body:
        assert f"example.py:{HEAD.count(chr(10)) + 1 + line}: in faulty: " in message
    said, written = message.rsplit("; ", 1)
    assert what in said and instead in written, message


@pytest.mark.parametrize(
    "text, message",
    [
        ("def faulty(x) -> float:\n    return x", "no annotation of x"),
        ("def faulty(x: str) -> float:\n    return 0.0", "annotation <class 'str'> of x"),
        ("def faulty(x: float):\n    pass", "annotation of the result"),
        ("def faulty(x: float, *y: float) -> None:\n    pass", "*args"),
        ("def faulty(x: 'Unknown') -> None:\n    pass", "name 'Unknown' is not defined"),
        ("def faulty(x: float) -> float:\n    if x > 1.0:\n        return x", "without a result"),
        ("faulty = lambda x: x", "no source found"),
    ],
)
def test_errors_of_whole_functions(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(Untranslatable, match=re.escape(message)):
        compiled(made(tmp_path, text).faulty).bind(0.0)
