"""Errors in the words of a command line."""

import contextlib
from collections.abc import Iterator
from typing import Any

import typer
from typer.core import TyperGroup

from ab_sim.quoting import visible

_UsageError: type[Exception] = typer.BadParameter.__mro__[1]
"""Typer has no name for it."""


class CommandGroup(TyperGroup):
    """Says what is wrong with a word, such as a file's name, without its control characters."""

    def make_context(self, *arguments: Any, **more: Any) -> Any:
        """As Typer's."""
        with _visible_errors():
            return super().make_context(*arguments, **more)

    def invoke(self, ctx: Any) -> Any:
        """As Typer's."""
        with _visible_errors():
            return super().invoke(ctx)


@contextlib.contextmanager
def _visible_errors() -> Iterator[None]:
    try:
        yield
    except _UsageError as error:
        error.message = visible(error.message)  # type: ignore[attr-defined]
        raise
