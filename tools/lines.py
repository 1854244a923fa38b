"""Lines of the core: of each folder, and of each purpose beside the core before it.

    python tools/lines.py [--former COMMIT]

A line is code, docstring, comment or blank; one with code and a comment is code. Texts that stand
by themselves are docstrings, also those behind a field. A file has one purpose: that of the longest
path in ``PURPOSES`` that it lies in. Counts the working tree; of the former core, what git has.
"""

import argparse
import ast
import io
import subprocess
import tarfile
import tokenize
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
FORMER = "8c8862e"
"""The last core with numba."""
NEW = (
    *("equations", "tracing", "dynamics", "kernels", "compiling"),
    *("events", "stepping", "taylor", "integrate"),
)
OLD = ("dynamics", "integrate")
"""Folders of the cores; ``numbers`` was in ``dynamics``."""


class Purpose(NamedTuple):
    """What files are for."""

    name: str
    old: str
    new: str
    """Paths below ab_sim, apart by blanks, in the former core and in this one."""


EFFECTS = "dynamics/effects dynamics/carriers dynamics/motion dynamics/spindle_motion"
PURPOSES = [
    Purpose(
        "formulas: effects, deck models, balls, the equations solved, energy",
        f"{EFFECTS} dynamics/ledger dynamics/race dynamics/slope dynamics/unsolved "
        "dynamics/linear_solver",
        "equations",
    ),
    Purpose(
        "from a scene to numbers: constants, layout, rest, linear parts, deck models' start",
        "dynamics dynamics/carriers/hanging dynamics/carriers/own_motion "
        "dynamics/carriers/planar_scene dynamics/carriers/tilting_scene",
        "dynamics",
    ),
    Purpose(
        "formulas as machine code, of one run and in lanes, and exact Jacobians",
        "dynamics/numbers dynamics/dispatch integrate/jacobian",
        "tracing kernels",
    ),
    Purpose(
        "control as machine code: by numba, with a cache on disk; by a compiler of its own",
        "dynamics/calling integrate/cache_folder integrate/compile_cache integrate/kept "
        "integrate/linked integrate/on_stack integrate/sources",
        "compiling",
    ),
    Purpose(
        "events: laws, location, impacts",
        "integrate/events dynamics/race/calls dynamics/race/impact dynamics/race/margins "
        "dynamics/race/pools dynamics/race/race dynamics/race/reactions dynamics/race/settle "
        "dynamics/race/table",
        "events",
    ),
    Purpose(
        "drivers of fixed steps: of one run, and of eight without events",
        "integrate/fixed_step integrate/samples integrate/side_by_side integrate/workspace",
        "stepping",
    ),
    Purpose(
        "implicit drag; in the former core collocation",
        "integrate/hand_over integrate/iteration integrate/left_out integrate/linear_motion "
        "integrate/response_tables integrate/responses integrate/span integrate/span_lengths "
        "integrate/steppers/collocation",
        "integrate/steppers/imex8",
    ),
    Purpose(
        "generalized-alpha",
        "integrate/steppers/generalized_alpha",
        "stepping/implicit integrate/steppers/generalized_alpha",
    ),
    Purpose(
        "steppers: registry, tableaus, limits, choice; f and its derivatives, flows",
        "integrate",
        "integrate",
    ),
    Purpose("drivers of eight runs with events", "", "stepping/over_events stepping/watch"),
    Purpose(
        "Taylor's method, of one run and of eight",
        "",
        "taylor integrate/steppers/taylor tracing/power_series",
    ),
    Purpose(
        "formulas printed: C, LaTeX, plain text, Python",
        "",
        "tracing/c_text tracing/latex tracing/local_names tracing/plain tracing/plain_text "
        "tracing/printed",
    ),
]


class Lines(NamedTuple):
    """How many there are."""

    files: int = 0
    code: int = 0
    docstrings: int = 0
    comments: int = 0
    blank: int = 0

    @property
    def all(self) -> int:
        """Of them."""
        return sum(self[1:])


def added(these: list[Lines]) -> Lines:
    """The sum."""
    return Lines(*map(sum, zip(Lines(), *these, strict=True)))


def lines_of(text: str) -> Lines:
    """Of a file."""
    docstrings: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            if isinstance(node.value.value, str):
                docstrings |= set(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    code: set[int] = set()
    comments: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            comments.add(token.start[0])
        elif token.string.strip():
            code |= set(range(token.start[0], token.end[0] + 1))
    code -= docstrings
    comments -= code | docstrings
    counts = len(code), len(docstrings), len(comments)
    return Lines(1, *counts, len(text.splitlines()) - sum(counts))


def here() -> dict[str, Lines]:
    """This core's files, by their paths below ab_sim, without .py."""
    package = ROOT / "ab_sim"
    files = (path for room in NEW for path in (package / room).rglob("*.py"))
    return {
        path.relative_to(package).with_suffix("").as_posix(): lines_of(path.read_text("utf-8"))
        for path in sorted(files)
    }


def former(commit: str) -> dict[str, Lines]:
    """The same of the former core."""
    folders = [f"ab_sim/{room}" for room in OLD]
    command = ["git", "-C", str(ROOT), "archive", commit, *folders]
    packed = subprocess.run(command, check=True, capture_output=True).stdout
    found = {}
    with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
        for member in archive:
            data = archive.extractfile(member) if member.name.endswith(".py") else None
            if data is not None:
                path = member.name.removeprefix("ab_sim/").removesuffix(".py")
                found[path] = lines_of(data.read().decode())
    return found


def by_purpose(files: Mapping[str, Lines], paths: Mapping[str, str]) -> dict[str, Lines]:
    """Lines of each purpose.

    Args:
        files: by path.
        paths: of purposes, by name.

    Raises:
        KeyError: a file has none.
    """
    known = {path: name for name, several in paths.items() for path in several.split()}
    found: dict[str, list[Lines]] = {name: [] for name in paths}
    for file, lines in files.items():
        parts = file.split("/")
        within = ["/".join(parts[:n]) for n in range(len(parts), 0, -1)]
        found[known[next((path for path in within if path in known), file)]].append(lines)
    return {name: added(each) for name, each in found.items()}


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--former", metavar="COMMIT", default=FORMER, help="default: %(default)s")
    old, new = former(parser.parse_args().former), here()
    print("| folder | files | code | docstrings | comments | blank | all |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for title, files, folders in (("former", old, OLD), ("this", new, NEW)):
        rows = {room: [x for f, x in files.items() if f.split("/")[0] == room] for room in folders}
        for name, each in [*rows.items(), (f"**{title} core**", [*files.values()])]:
            total = added(each)
            print(f"| {name} | {' | '.join(f'{n:,}' for n in (*total, total.all))} |")
    was = by_purpose(old, {each.name: each.old for each in PURPOSES})
    now = by_purpose(new, {each.name: each.new for each in PURPOSES})
    print("\n| lines of code for | former | this |\n| --- | --- | --- |")
    for title, own in (
        ("**what both have**", [each.name for each in PURPOSES if each.old]),
        ("**what this one has alone**", [each.name for each in PURPOSES if not each.old]),
    ):
        for name in own:
            print(f"| {name} | {was[name].code:,} | {now[name].code:,} |")
        sums = [sum(each[name].code for name in own) for each in (was, now)]
        print(f"| {title} | {sums[0]:,} | {sums[1]:,} |")


if __name__ == "__main__":
    main()
