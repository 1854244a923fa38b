"""Syntax trees of the project's files, each parsed once in a process."""

import ast
import functools
from pathlib import Path


@functools.cache
def nodes(path: Path) -> tuple[ast.AST, ...]:
    """Return all nodes of a file's syntax tree, parents before children."""
    return tuple(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
