"""Names of classes and modules are unique, and agree with the glossary."""

import ast
import functools
import importlib
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from ab_sim.scene import Scene
from tests.trees import nodes

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "ab_sim"
GLOSSARY = ROOT / "docs" / "glossary.md"

# Modules of commands, pictures and studies are named after their subject on purpose.
NAMED_FOR_A_SUBJECT = {"cli", "show", "accuracy_cost"}
# Classes of a scene's sections have the names of its keys, and so do packages on these topics. The
# other classes are the main subject of their package.
SECTIONS = {"Accuracy", "Balanced", "Balls", "Deck", "Race", "Scene", "Spindle"}


def room_of(path: Path) -> str:
    room, *inner = path.with_suffix("").relative_to(PACKAGE).parts
    return inner[0] if inner and inner[0] in NAMED_FOR_A_SUBJECT else room


def public_classes() -> dict[str, list[Path]]:
    found = defaultdict(list)
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in nodes(path):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found[node.name].append(path)
    return found


def test_a_class_name_is_there_once() -> None:
    twice = {
        name: [str(path.relative_to(ROOT)) for path in paths]
        for name, paths in public_classes().items()
        if len(paths) > 1
    }
    assert twice == {}


def test_no_class_is_named_like_a_module_of_another_room() -> None:
    rooms = defaultdict(set)
    for path in PACKAGE.rglob("*.py"):
        module = path.parent if path.name == "__init__.py" else path
        if module != PACKAGE and room_of(module) not in NAMED_FOR_A_SUBJECT:
            rooms[module.stem].add(room_of(module))
    clashes = [
        (name, str(path.relative_to(ROOT)), sorted(others))
        for name, paths in public_classes().items()
        for path in paths
        if room_of(path) not in NAMED_FOR_A_SUBJECT and name not in SECTIONS
        if (others := rooms[re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower()])
        and room_of(path) not in others
    ]
    assert clashes == []


def glossary() -> list[list[str]]:
    rows = re.findall(r"^\| (.+) \|$", GLOSSARY.read_text(encoding="utf-8"), re.MULTILINE)
    return [re.split(r"(?<!\\) \| ", row) for row in rows[2:]]


def test_the_glossary_is_short_and_sorted() -> None:
    words = [row[0] for row in glossary()]
    assert 0 < len(words) <= 60 and len(set(words)) == len(words)
    assert words == sorted(words, key=str.lower)
    assert {len(row) for row in glossary()} == {5}


def test_what_the_glossary_names_is_there() -> None:
    for word, *_, where in glossary():
        names = re.findall(r"`([\w.]+)`", where)
        assert names, word
        for name in names:
            assert resolved(f"ab_sim.{name}"), name


def test_what_the_walk_through_the_packages_names_is_there() -> None:
    page = (ROOT / "docs" / "explanation" / "architecture.md").read_text(encoding="utf-8")
    names = set(re.findall(r"`([a-z_]+(?:\.\w+)+)`", page))
    for name in names:
        whole = name if name.startswith("ab_") else f"ab_sim.{name}"
        assert resolved(whole), name
    assert len(names) > 30


def resolved(name: str) -> bool:
    """Return whether a module, or an object in a module, has this name."""
    parts = name.split(".")
    for end in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(parts[:end]))
        except ImportError:
            continue
        return all(hasattr(found, part) and (found := getattr(found, part)) for part in parts[end:])
    return False


def modules_by_tail() -> dict[str, list[Path]]:
    """Return modules by each suffix of their dotted names: ``drive.steps`` is also ``steps``."""
    found = defaultdict(list)
    for path in [*PACKAGE.rglob("*.py"), *(ROOT / "ab_msgs_py").rglob("*.py")]:
        parts = path.relative_to(ROOT).with_suffix("").parts
        parts = parts[:-1] if parts[-1] == "__init__" else parts
        for first in range(len(parts)):
            found[".".join(parts[first:])].append(path)
    return found


@functools.cache
def names_in(path: Path) -> set[str]:
    """Return the names that a module defines or imports, at any depth."""
    names: set[str] = set()
    for node in nodes(path):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            names.update(alias.asname or alias.name for alias in node.names)
    return names


def test_what_docstrings_name_in_a_module_is_there() -> None:
    """Check each ``module.name`` in double backticks, except keys of scenes and files."""
    modules, keys, missing, seen = modules_by_tail(), set(Scene.model_fields), [], 0
    for path in PACKAGE.rglob("*.py"):
        for name in re.findall(r"``([A-Za-z_][\w.]*\.\w+)``", path.read_text(encoding="utf-8")):
            module, _, last = name.rpartition(".")
            words = set(name.removeprefix("scene.").split(".")[:1])
            if name in modules or module not in modules or words & (keys | {"startup"}):
                continue
            seen += 1
            if not any(last in names_in(each) for each in modules[module]):
                missing.append(f"{path.relative_to(ROOT)}: {name}")
    assert seen > 40 and missing == []


USERS = (
    "ab_sim",
    "ab_msgs_py",
    "benchmarks",
    "config",
    "docs",
    "examples",
    "launch",
    "tests",
    "tools",
)
NAMED = re.compile(r"(?:^|[.:`]|import )([A-Za-z_]\w*)")
"""Names in a text: at its beginning, after a dot or colon, in backticks, or imported."""


def names_used(path: Path) -> set[str]:
    """Return names that a file imports, takes as attributes, or has in texts."""
    if path.suffix != ".py":
        return set(NAMED.findall(path.read_text(encoding="utf-8", errors="replace")))
    names = set()
    for node in nodes(path):
        if isinstance(node, ast.ImportFrom):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.Attribute):
            names.add(node.attr)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            names |= set(NAMED.findall(node.value))
    return names


def constants_and_functions(path: Path) -> Iterator[str]:
    """Yield a file's names without an underscore; classes may leave it as results."""
    module = nodes(path)[0]
    assert isinstance(module, ast.Module)
    for node in module.body:
        if isinstance(node, ast.FunctionDef) and not node.decorator_list:
            yield node.name
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        yield from (x.id for x in targets if isinstance(x, ast.Name) and x.id.isupper())


def test_what_only_its_own_file_uses_begins_with_an_underscore() -> None:
    endings = {".py", ".md", ".toml", ".yaml", ".ipynb", ".sh"}
    files = [p for user in USERS for p in (ROOT / user).rglob("*") if p.suffix in endings]
    users = defaultdict(set)
    for path in [*files, *ROOT.glob("*.py"), *ROOT.glob("*.md")]:
        for name in names_used(path):
            users[name].add(path)
    only_own = [
        (str(path.relative_to(ROOT)), name)
        for path in sorted(PACKAGE.rglob("*.py"))
        for name in constants_and_functions(path)
        if not name.startswith("_") and not users[name] - {path}
    ]
    assert only_own == []


PRIVATE = re.compile(r"_[^_]\w*")
ALLOWED = {
    *("_asdict", "_field_defaults", "_fields", "_make", "_replace"),  # public names of NamedTuple
    *("_repr_html_", "_repr_png_"),  # public names of IPython
    "_next",  # of FairLock: only this lock tells that a thread waits
}
"""Names with an underscore that tests use on objects other than ``self``."""


def private_names(path: Path) -> Iterator[str]:
    """Yield private attributes, imports, and texts for ``setattr`` in a file."""
    for node in nodes(path):
        if isinstance(node, ast.Attribute):
            names = [] if getattr(node.value, "id", "") in ("self", "cls") else [node.attr]
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("ab_"):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.Call) and "attr" in ast.unparse(node.func):
            names = [str(getattr(each, "value", "")).rpartition(".")[2] for each in node.args]
        else:
            continue
        yield from filter(PRIVATE.fullmatch, names)


def test_tests_use_no_private_names() -> None:
    """Observe public behaviour, or give the name without an underscore, instead."""
    used = {
        (str(path.relative_to(ROOT)), name)
        for path in (ROOT / "tests").rglob("*.py")
        for name in private_names(path)
        if name not in ALLOWED
    }
    assert used == set()
