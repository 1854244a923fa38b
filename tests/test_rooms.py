"""Layering: packages import only from lower ones, and modules do not import each other in cycles.

Imports for type checkers and imports within functions count, too, and so do texts that name a
module, such as ``"ab_sim.cli.run:run_command"``. One table names modules above it: the registries.
"""

import ast
import functools
import importlib.util
import itertools
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

import ab_sim
from ab_sim.base.registries import REGISTRIES
from tests.trees import nodes

ORDER = (
    ("base.errors", "base.named_entries", "base.registries", "base.version"),
    (
        "base.files",
        "base.interruption",
        "base.numbers",
        "base.ordered_sum",
        "base.palette",
        "base.plug_ins",
        "base.presentation",
        "base.protobuf",
        "base.sample_columns",
    ),
    ("base.sources", "base.workers", "base.yaml_files"),
    ("tracing", "control"),
    ("scene",),
    ("model.spindle", "model.equations"),
    ("model.dynamics",),
    ("engine.compiling",),
    ("engine.kernels", "engine.events"),
    ("engine.integrate",),
    ("engine.stepping",),
    ("engine.taylor",),
    ("drive.pickup",),
    ("drive",),
    ("drive.accuracy",),
    ("export.c_code", "export.formulas"),
    ("record.recording",),
    ("record.bags",),
    ("analysis",),
    ("design.batch",),
    ("design",),
    ("identification",),
    ("show.viewing",),
    ("show",),
    ("api",),
    ("results",),
    ("nodes",),
    ("cli",),
    ("__main__",),
)
"""Packages from the lowest to the highest; those in one group do not import each other.

The packages of one room stand together, so that rooms import only from lower rooms, too.
"""
PLACE = {room: place for place, rooms in enumerate(ORDER) for room in rooms}
HOLLOW = {place.partition(".")[0] for place in PLACE if "." in place} - PLACE.keys()
"""Rooms that only hold packages."""
PLACES = ("ab_sim", "ab_msgs_py", "benchmarks", "docs", "tests", "tools")
"""Folders of the project's own files."""
HOUSE = Path(ab_sim.__file__).parent


def modules() -> dict[str, Path]:
    """Return every module of the package by its name."""
    names = {}
    for path in HOUSE.rglob("*.py"):
        parts = path.relative_to(HOUSE.parent).with_suffix("").parts
        names[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return names


def imports(name: str, path: Path, statements: Iterable[ast.AST] = ()) -> Iterator[str]:
    """Return the full names of modules that a module, or some of its statements, imports."""
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    for node in statements or nodes(path):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = importlib.util.resolve_name("." * node.level + (node.module or ""), package)
            for alias in node.names:
                whole = f"{base}.{alias.name}"
                yield whole if whole in MODULES else base


MODULES = modules()


@functools.cache  # computed at the first call, as every test process imports this file
def all_imports() -> dict[str, set[str]]:
    """Return the imports from the package, by module."""
    return {
        name: {found for found in imports(name, path) if found.startswith("ab_sim.")}
        for name, path in MODULES.items()
    }


def named(path: Path) -> Iterator[str]:
    """Yield the modules of the package that the texts of a file name."""
    for node in nodes(path):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            name = node.value.partition(":")[0]
            if name.startswith("ab_sim.") and name in MODULES:
                yield name


def room_of(module: str) -> str:
    """Return the package in `ORDER` that a module belongs to; a room without code is its own."""
    inner = ".".join(module.split(".")[1:3])
    return inner if inner in PLACE else inner.partition(".")[0]


def test_every_package_has_its_place() -> None:
    found = {room_of(name) for name in MODULES if name != "ab_sim"}
    assert found - HOLLOW == set(PLACE)


def test_packages_of_a_room_stand_together() -> None:
    rooms = [place.partition(".")[0] for group in ORDER for place in group]
    assert len(list(itertools.groupby(rooms))) == len(set(rooms))


def test_a_room_knows_only_what_is_before_it() -> None:
    back = {
        f"{name} imports {found}"
        for name, wanted in all_imports().items()
        for found in wanted.union(named(MODULES[name]))
        if name not in ("ab_sim", "ab_sim.base.registries")
        if (room := room_of(name)) != (other := room_of(found))
        if PLACE[other] >= PLACE[room]
    }
    assert back == set()


def test_registries_are_above_the_rooms_that_read_them() -> None:
    """A registry that need not be in the table is imported instead."""
    lowest = min(PLACE[room_of(name)] for name in REGISTRIES.values())
    readers = [name for name, wanted in all_imports().items() if "ab_sim.base.registries" in wanted]
    assert max(PLACE[room_of(name)] for name in readers) < lowest


def test_no_module_imports_the_package_for_its_version() -> None:
    package = {name for name, path in MODULES.items() if "ab_sim" in imports(name, path)}
    assert not package - {"ab_sim"}


def test_the_page_lists_every_package_from_the_top() -> None:
    page = (HOUSE.parent / "docs" / "explanation" / "architecture.md").read_text(encoding="utf-8")
    rows = [row.split("|")[2] for row in page.splitlines() if re.match(r"\|.*\| `ab_sim", row)]
    listed = [re.findall(r"`ab_sim\.([\w.]+)`", row) for row in rows]
    packages = {room_of(name) for name, path in MODULES.items() if path.name == "__init__.py"}
    assert packages - HOLLOW - {""} <= {room for rooms in listed for room in rooms}
    lowest = len(ORDER)
    for rooms in filter(None, listed):
        inner = tuple(f"{room}." for room in rooms)
        places = [PLACE[known] for known in PLACE if known in rooms or known.startswith(inner)]
        assert max(places) <= lowest, f"{rooms} lie above what is listed before them"
        lowest = min(places)


def test_no_circles_within_a_room() -> None:
    """Modules can be sorted so that each comes after all that it imports."""
    # ab_sim/__init__.py imports the public names, for type checkers; every module may import its
    # version from it.
    ahead = {name: all_imports()[name] & MODULES.keys() for name in MODULES if name != "ab_sim"}
    while free := [name for name, wanted in ahead.items() if not wanted & ahead.keys() - {name}]:
        for name in free:
            del ahead[name]
    assert not ahead, "these import each other"


def imported_together(name: str) -> set[str]:
    """Return all modules that are imported with a module, without those within functions."""
    ahead, together = [name], set[str]()
    while ahead:
        module = ahead.pop()
        packages = [module[: end.start()] for end in re.finditer(r"\.", module)]
        wanted = {module, *packages} - together
        together |= wanted
        for own in wanted & MODULES.keys():
            tree = nodes(MODULES[own])[0]
            assert isinstance(tree, ast.Module)
            ahead += imports(own, MODULES[own], tree.body)
    return together


@pytest.mark.parametrize(
    ("module", "slow"),
    [
        ("ab_sim.cli.identify", {"rerun", "rosbags"}),  # for tables of numbers
        ("ab_sim.cli.replay", {"rerun", "matplotlib", "plotly"}),
        ("ab_sim.cli.run", {"rerun", "rosbags", "scipy", "matplotlib", "plotly"}),
        ("ab_sim.nodes.bag_replay", {"rerun", "matplotlib", "plotly"}),
        ("ab_sim.nodes.drive_sim", {"rerun", "rosbags", "matplotlib", "plotly"}),
        ("ab_sim.nodes.recorder", {"rosbags", "matplotlib", "plotly"}),  # without a bag
    ],
)
def test_slow_packages_are_imported_on_use(module: str, slow: set[str]) -> None:
    """Each of them takes 0.2 to 0.6 s to import."""
    assert not slow & imported_together(module)


def test_the_messages_know_nobody() -> None:
    """``ab_msgs_py`` is for programs without the simulator."""
    package = HOUSE.parent / "ab_msgs_py"
    for path in package.glob("*.py"):
        assert not any(found.startswith("ab_sim") for found in imports("ab_msgs_py.any", path))


def test_no_file_is_longer_than_six_hundred_lines() -> None:
    """Files in the package, its tests, the gallery and the benchmarks have one subject each."""
    root = HOUSE.parent
    files = [p for place in PLACES for p in (root / place).rglob("*.py")]
    long = {str(p.relative_to(root)): n for p in files if (n := len(p.open().readlines())) > 600}
    assert len(files) > 800 and not long
