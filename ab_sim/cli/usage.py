"""Usage errors of the command line."""

import contextlib
from collections.abc import Iterator
from typing import Any

import typer
from typer.core import TyperGroup

from ab_sim.cli.contents import CONTENTS
from ab_sim.quoting import visible

_UsageError: type[Exception] = typer.BadParameter.__mro__[1]
"""Typer's class of usage errors, for which it has no name."""


class CommandGroup(TyperGroup):
    """Group that lists commands under the headings of ``CONTENTS``, and makes errors safe to print.

    Control characters are removed from words that an error quotes, such as names of files.
    """

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self._names = [name for names in CONTENTS.values() for name in names]
        for heading, names in CONTENTS.items():
            for name in names:
                self.commands[name].rich_help_panel = heading  # type: ignore[attr-defined]

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of all commands, in the order of the contents; others come last."""
        return [*self._names, *(name for name in self.commands if name not in self._names)]

    def make_context(self, *arguments: Any, **more: Any) -> Any:
        """Make errors visible in Typer's method."""
        with _visible_errors():
            return super().make_context(*arguments, **more)

    def invoke(self, ctx: Any) -> Any:
        """Make errors visible in Typer's method."""
        with _visible_errors():
            return super().invoke(ctx)


@contextlib.contextmanager
def _visible_errors() -> Iterator[None]:
    try:
        yield
    except _UsageError as error:
        error.message = visible(error.message)  # type: ignore[attr-defined]
        raise
