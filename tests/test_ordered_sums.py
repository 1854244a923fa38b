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
    "drive/accuracy/trials.py: deviation": "error of a setting, which is measured",
    "drive/bodies.py: _move_ball": "poses that ROS services set",
    "drive/bodies.py: _move_deck": "poses that ROS services set",
    "drive/bodies.py: motion_of": "poses that ROS services read",
    "drive/closed_forms.py: WhirlWithoutBalls": "to 1e-11",
    "drive/closed_forms.py: _exponentials": "whirl without balls, to 1e-11",
    "drive/faults/plant.py: stop_held_balls": "a ball that jams or comes free",
    "engine/integrate/explicit.py: explicit": "limits of steps",
    "model/dynamics/assemble.py: _motor_rates": "limits of steps",
    "model/dynamics/assemble.py: drag_rate": "limits of steps",
    "model/dynamics/at_rest.py: Linearised": "small motions",
    "model/dynamics/at_rest.py: place_at_rest": "position at rest",
    "model/dynamics/deck_models/in_space.py: _at_rest": "position at rest",
    "model/dynamics/deck_models/in_space.py: _away": "position at rest",
    "model/dynamics/deck_models/in_space.py: _hardened": "position at rest",
    "model/dynamics/deck_models/in_space.py: _stiffness_against_turning": "small motions",
    "model/dynamics/deck_models/in_space.py: linearised": "small motions",
    "model/dynamics/deck_models/in_space.py: rates_of": "limits of steps",
    "model/dynamics/deck_models/in_space.py: _yields_of": "limits of steps",
    "model/equations/in_space.py: InSpace": "norm of one quaternion",
}
"""Functions and classes that may, and what they compute."""


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
    lines = {
        f"{path.relative_to(ROOT)}: {getattr(part, 'name', 'imports')}": numbers
        for room in ROOMS
        for path in (ROOT / room).rglob("*.py")
        for part in ast.parse(path.read_text(encoding="utf-8")).body
        if (numbers := sorted({*found(part)}))
    }
    assert {place: numbers for place, numbers in lines.items() if place not in EXCEPT} == {}
    assert EXCEPT.keys() <= lines.keys()


def test_such_products_are_found() -> None:
    text = "a @ b\nnp.einsum('i', a)\nnp.polynomial.legendre.legval(x, c)\nnp.linalg.norm(a)"
    text += "\nfrom scipy.linalg import solve"
    assert sorted({*found(ast.parse(text))}) == [1, 2, 3, 4, 5]
