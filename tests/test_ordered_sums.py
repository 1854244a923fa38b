"""What a run prints has the same bits on any machine: no BLAS, and nothing of NumPy's own order.

Products by BLAS and einsum round differently on different processors. NumPy 2.4 reordered the terms
of ``legval``, which changed runs with stiff drag from NumPy 2.2 on by 7e-9.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import ab_sim

ROOT = Path(ab_sim.__file__).parent
ROOMS = ("drive", "engine", "model")
FUNCTIONS = {"dot", "einsum", "inner", "matmul", "tensordot", "vdot", "linalg", "polynomial"}
EXCEPT = {
    "drive/accuracy/deviation.py": "error of a setting, which is measured",
    "drive/bodies.py": "poses that ROS services read and set",
    "drive/faults/plant.py": "a ball that jams or comes free",
    "drive/rotor_without_balls.py": "whirl without balls, to 1e-11",
    "engine/integrate/explicit.py": "limits of steps",
    "model/dynamics/assemble.py": "limits of steps",
    "model/dynamics/deck_models/in_space.py": "small motions, limits of steps, position at rest",
    "model/dynamics/hanging.py": "position at rest",
    "model/dynamics/linearised.py": "small motions",
    "model/equations/in_space.py": "norm of one quaternion",
}
"""Files that may, and what they compute."""


def found(tree: ast.AST) -> Iterator[int]:
    """Yield the lines with products or functions of this kind."""
    for node in ast.walk(tree):
        if isinstance(node, ast.BinOp | ast.AugAssign) and isinstance(node.op, ast.MatMult):
            yield node.lineno
        elif isinstance(node, ast.Attribute) and node.attr in FUNCTIONS:
            yield node.lineno
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[-1] in FUNCTIONS:
            yield node.lineno


def test_what_a_run_computes_has_an_order() -> None:
    files = {
        path.relative_to(ROOT).as_posix(): sorted({*found(ast.parse(path.read_text()))})
        for room in ROOMS
        for path in (ROOT / room).rglob("*.py")
    }
    lines = {name: numbers for name, numbers in files.items() if numbers}
    assert {name: numbers for name, numbers in lines.items() if name not in EXCEPT} == {}
    assert EXCEPT.keys() == lines.keys() & EXCEPT.keys()


def test_such_products_are_found() -> None:
    text = "a @ b\nnp.einsum('i', a)\nnp.polynomial.legendre.legval(x, c)\nnp.linalg.norm(a)"
    text += "\nfrom scipy.linalg import solve"
    assert sorted({*found(ast.parse(text))}) == [1, 2, 3, 4, 5]
