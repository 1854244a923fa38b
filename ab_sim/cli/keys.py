"""`ab-sim keys`, `ab-sim schema`."""

import json
from pathlib import Path

from rich.table import Table

from ab_sim.cli.outputs import PlainConsole, check_files, say_written, write_json
from ab_sim.output_file import REPORT
from ab_sim.scene.keys import SceneKey, scene_keys
from ab_sim.scene.schema import scene_schema

console = PlainConsole()
WHOLE = 2000
"""Width of the table for other programs [columns]; more than any key needs."""


def print_keys(section: str, as_json: bool) -> None:
    """Print the keys of a scene, or of one section.

    Raises:
        InputError: there is no such section; the message names the nearest.
    """
    rows = scene_keys(section)
    if as_json:
        print(json.dumps([row._asdict() for row in rows], indent=1))
        return
    table = Table()
    for column in SceneKey._fields:
        table.add_column(column, overflow="fold")
    for row in rows:
        table.add_row(*row)
    if not console.is_terminal:  # another program reads it: one line per key
        console.width = WHOLE
    console.print(table)


def print_schema(out: Path | None) -> None:
    """Print the JSON Schema of a scene file.

    Raises:
        InputError: the file cannot be written.
    """
    files = check_files((out, REPORT, "--out"))
    write_json(scene_schema(), "-" if out is None else str(out))
    say_written(files)
