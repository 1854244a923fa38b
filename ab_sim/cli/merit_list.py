"""`ab-sim merits`."""

import json

from rich.table import Table

from ab_sim.analysis.merits import described_merits
from ab_sim.analysis.merits.merit import MeritInWords
from ab_sim.cli.outputs import PlainConsole

console = PlainConsole()
WHOLE = 2000
"""Width of the table for other programs [columns]; more than any metric needs."""
LISTED = ("name", "unit", "better", "taken_by", "meaning", "equation")


def print_merits(name: str | None, as_json: bool) -> None:
    """Print the metrics of runs, or one of them.

    Raises:
        InputError: there is no such metric; the message names the nearest and all.
    """
    found = described_merits(name)
    if as_json:
        print(json.dumps([each._asdict() for each in found], indent=1))
        return
    if not console.is_terminal:  # another program reads it: one line per metric
        console.width = WHOLE
    if name is not None:
        console.print(_one(found[0]))
        return
    table = Table()
    for column in LISTED:
        table.add_column(column, overflow="fold")
    for each in found:
        table.add_row(*(str(getattr(each, column)) for column in LISTED))
    console.print(table)


def _one(merit: MeritInWords) -> Table:
    table = Table(show_header=False)
    for label, text in merit._asdict().items():
        table.add_row(label, text)
    return table
