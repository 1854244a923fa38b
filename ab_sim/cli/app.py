"""The program `ab-sim`: its commands under eight headings."""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from ab_sim.base.errors import visible
from ab_sim.base.plug_ins import load_files
from ab_sim.base.version import __version__
from ab_sim.cli.analysis_commands import stability_and_vibration
from ab_sim.cli.design_commands import choose_a_design
from ab_sim.cli.node_commands import node_commands
from ab_sim.cli.recording_commands import nodes_and_bags, recordings_and_measurements
from ab_sim.cli.scene_commands import accuracy_and_cost, other_tools, run_and_watch, write_a_scene

_UsageError: type[Exception] = typer.BadParameter.__mro__[1]
"""Class of Typer's usage errors, which Typer does not export."""


class SafeGroup(TyperGroup):
    """Group whose usage errors are safe to print, and whose numbers have the digits 0 to 9.

    Control characters are removed from words that an error quotes, such as names of files.
    """

    def make_context(self, *arguments: Any, **more: Any) -> Any:
        """Call Typer's method, with control characters removed from its errors."""
        with _visible_errors():
            return super().make_context(*arguments, **more)

    def invoke(self, ctx: Any) -> Any:
        """Call Typer's method, with control characters removed from its errors."""
        with _visible_errors():
            return super().invoke(ctx)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Refuse digits other than 0 to 9, which Typer's method accepts."""
        for word in args:
            if _is_number_of_other_digits(word.rpartition("=")[2]):
                raise typer.BadParameter(f"{word}: numbers must have the digits 0 to 9")
        return super().parse_args(ctx, args)


def _is_number_of_other_digits(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return not word.isascii()


@contextlib.contextmanager
def _visible_errors() -> Iterator[None]:
    try:
        yield
    except _UsageError as error:
        error.message = visible(error.message)  # type: ignore[attr-defined]
        raise


def _version(show: bool) -> None:
    if show:
        print(f"ab_sim {__version__}")
        raise typer.Exit()


app = typer.Typer(
    name="ab-sim",
    cls=SafeGroup,
    help="Simulate an optical disc drive with a ball-type automatic balancer.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
)


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
    load: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="Python file to run first, for example to register your own effects, metrics or "
            "steppers. It can do anything that you can do: load only files that you trust. "
            "Repeatable.",
        ),
    ] = None,
) -> None:
    load_files(load or ())


HEADINGS = (
    run_and_watch,
    write_a_scene,
    choose_a_design,
    stability_and_vibration,
    accuracy_and_cost,
    recordings_and_measurements,
    nodes_and_bags,
    other_tools,
)
"""Headings of ``ab-sim --help``, in their order."""
for _heading in HEADINGS:
    if _heading is nodes_and_bags:
        app.add_typer(node_commands, name="node", rich_help_panel=_heading.heading)
    app.add_typer(_heading)
