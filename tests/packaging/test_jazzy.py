"""rclpy of Jazzy has no generic classes, so annotations with subscripts of them must stay text.

The tests that run on Jazzy cover few nodes; this one covers all files.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import ab_msgs_py
import ab_sim

FILES = sorted(
    file
    for package in (ab_sim, ab_msgs_py)
    for file in Path(str(package.__file__)).parent.rglob("*.py")
    if "rclpy" in file.read_text()
)


def imports(tree: ast.Module, package: str) -> Iterator[str]:
    """Yield the names that a file imports from a package and its modules."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == package:
            yield from (name.name for name in node.names)


def annotations(tree: ast.Module) -> Iterator[ast.expr]:
    """Yield the annotations of a file."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and node.returns is not None:
            yield node.returns
        elif isinstance(node, ast.arg | ast.AnnAssign) and node.annotation is not None:
            yield node.annotation


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_annotations_with_classes_of_rclpy_stay_text(file: Path) -> None:
    tree = ast.parse(file.read_text(encoding="utf-8"))
    known = set(imports(tree, "rclpy"))
    subscripted = {
        node.value.id
        for annotation in annotations(tree)
        for node in ast.walk(annotation)
        if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name)
    }
    if used := subscripted & known:
        future = [*imports(tree, "__future__")]
        assert "annotations" in future, f"{file}: {used} need `from __future__ import annotations`"
