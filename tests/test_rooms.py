"""One way through the house: what a room imports lies before it, and no module imports in circles.

Imports for type checkers only count, too, and so do those within functions: they put off what takes
long, and change no direction.
"""

import ast
import functools
import importlib.util
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import ab_sim

ORDER = (
    ("errors", "quoting"),
    (
        "cache_folder",
        "conventions",
        "file_locks",
        "interruption",
        "limited_yaml",
        "output_file",
        "palette",
        "presentation",
        "stored_numbers",
    ),
    ("control", "scene_files", "sources", "tracing", "workers"),
    ("scene", "compiling"),
    ("spindle", "equations"),
    ("dynamics",),
    ("kernels", "events"),
    ("integrate",),
    ("stepping",),
    ("collocation", "taylor"),
    ("sensing",),
    ("drive",),
    ("accuracy", "c_code"),
    ("analysis", "recording", "viewing"),
    ("batch", "bags"),
    ("studies", "design"),
    ("identification",),
    ("formulas",),
    ("figures",),
    ("reports",),
    ("api",),
    ("results",),
    ("nodes",),
    ("cli",),
    ("__main__",),
)
"""Rooms, left to right; those in a group do not know each other."""
PLACE = {room: place for place, rooms in enumerate(ORDER) for room in rooms}
PLACES = ("ab_sim", "ab_msgs_py", "benchmarks", "docs", "tests", "tools")
"""Where our own files are."""
HOUSE = Path(ab_sim.__file__).parent


def modules() -> dict[str, Path]:
    """Every module of the package by its name."""
    names = {}
    for path in HOUSE.rglob("*.py"):
        parts = path.relative_to(HOUSE.parent).with_suffix("").parts
        names[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return names


def imports(name: str, path: Path) -> Iterator[str]:
    """What a module imports of the package, by its full name."""
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    ahead: list[ast.AST] = [ast.parse(path.read_text(encoding="utf-8"))]
    while ahead:
        node = ahead.pop()
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = importlib.util.resolve_name("." * node.level + (node.module or ""), package)
            for alias in node.names:
                whole = f"{base}.{alias.name}"
                yield whole if whole in MODULES else base
        ahead += ast.iter_child_nodes(node)


MODULES = modules()


@functools.cache  # not on import: every process of the tests imports this file
def all_imports() -> dict[str, set[str]]:
    """What each module imports of the package."""
    return {
        name: {found for found in imports(name, path) if found.startswith("ab_sim.")}
        for name, path in MODULES.items()
    }


def room_of(module: str) -> str:
    return module.split(".")[1]


def test_every_room_has_its_place() -> None:
    assert {room_of(name) for name in MODULES if name != "ab_sim"} == set(PLACE)


@pytest.mark.parametrize("room", PLACE)
def test_a_room_knows_only_what_is_before_it(room: str) -> None:
    back = {
        f"{name} imports {found}"
        for name, wanted in all_imports().items()
        for found in wanted
        if name != "ab_sim" and room_of(name) == room != room_of(found)
        if PLACE[room_of(found)] >= PLACE[room]
    }
    assert not back


def test_the_page_lists_every_package_from_the_top() -> None:
    page = (HOUSE.parent / "docs" / "explanation" / "architecture.md").read_text(encoding="utf-8")
    rows = [row.split("|")[1] for row in page.splitlines() if row.startswith("| `ab_sim")]
    listed = [re.findall(r"`ab_sim\.(\w+)`", row) for row in rows]
    packages = {path.parent.name for path in HOUSE.glob("*/__init__.py")}
    assert packages <= {room for rooms in listed for room in rooms}
    lowest = len(ORDER)
    for rooms in filter(None, listed):
        places = [PLACE[room] for room in rooms]
        assert max(places) <= lowest, f"{rooms} lie above what is listed before them"
        lowest = min(places)


def test_no_circles_within_a_room() -> None:
    """Modules can be put in a line, each after all that it imports."""
    # The package's face names what it hands out, for type checkers; all may ask it for its version.
    ahead = {name: all_imports()[name] & MODULES.keys() for name in MODULES if name != "ab_sim"}
    while free := [name for name, wanted in ahead.items() if not wanted & ahead.keys() - {name}]:
        for name in free:
            del ahead[name]
    assert not ahead, "these import each other"


def test_the_messages_know_nobody() -> None:
    """``ab_msgs_py`` serves programs that have no simulator."""
    package = HOUSE.parent / "ab_msgs_py"
    for path in package.glob("*.py"):
        assert not any(found.startswith("ab_sim") for found in imports("ab_msgs_py.any", path))


def test_no_file_is_longer_than_five_hundred_lines() -> None:
    """A longer one may be two ideas: in the package, its tests, the gallery and the benchmarks."""
    root = HOUSE.parent
    files = [p for place in PLACES for p in (root / place).rglob("*.py")]
    long = {str(p.relative_to(root)): n for p in files if (n := len(p.open().readlines())) > 500}
    assert len(files) > 800 and not long
