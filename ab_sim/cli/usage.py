"""Errors in the words of a command line."""

import contextlib
from collections.abc import Iterator
from typing import Any

import typer
from typer.core import TyperGroup

from ab_sim.cli.contents import CONTENTS
from ab_sim.quoting import visible

_UsageError: type[Exception] = typer.BadParameter.__mro__[1]
"""Typer has no name for it."""


class CommandGroup(TyperGroup):
    """Lists commands under the headings of ``CONTENTS``, and makes errors safe to print.

    An error names a word, such as a file's name, without its control characters.
    """

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self._names = [name for names in CONTENTS.values() for name in names]
        for heading, names in CONTENTS.items():
            for name in names:
                self.commands[name].rich_help_panel = heading  # type: ignore[attr-defined]

    def list_commands(self, ctx: Any) -> list[str]:
        """Names of all commands, in the order of the contents; others last."""
        return [*self._names, *(name for name in self.commands if name not in self._names)]

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
