"""Commands about the keys of a scene file."""

from pathlib import Path
from typing import Annotated

import typer

key_commands = typer.Typer()


@key_commands.command()
def keys(
    section: Annotated[
        str,
        typer.Argument(
            help="Only the keys that begin so, e.g. rotor, effects.motor, solver.parameters.",
            show_default=False,
        ),
    ] = "",
    json: Annotated[
        bool, typer.Option("--json", help="Print the same as JSON, a list of keys.")
    ] = False,
) -> None:
    """List the keys of a scene: unit, range, default, meaning.

    `N` stands for the number of an entry in a list, counted from 0; `NAME` for a name of your own.
    A key that is required is so where its section is given. `-`: has none. `ab-sim effects` and
    `ab-sim sensors` say more, `ab-sim run --set KEY=VALUE` changes a key. Where a key has a unit,
    a number may be written with one of the same dimension: `12 mm`, `2500 rpm`.
    """
    from ab_sim.cli.keys import print_keys

    print_keys(section, json)


@key_commands.command()
def schema(
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write it to a .json file. Default: standard output."),
    ] = None,
) -> None:
    """Print the JSON Schema of scene files, for editors.

    With yaml-language-server (VS Code's YAML extension, Neovim, Emacs, Helix): run
    `ab-sim schema --out scene.schema.json`, and begin a scene beside it with the line
    `# yaml-language-server: $schema=scene.schema.json`

    The editor then shows meanings and units, and marks unknown keys and numbers out of range.
    `ab-sim check` checks more: how keys go together.
    """
    from ab_sim.cli.keys import print_schema

    print_schema(out)
