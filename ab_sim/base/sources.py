"""Sources of a kernel, determined from imports, so that no list of files must be maintained."""

import ast
import functools
import hashlib
import importlib.util
import os
import sys
import time
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path
from typing import NamedTuple

_TYPES_ONLY = ("TYPE_CHECKING", "typing.TYPE_CHECKING")


class NotOfSources(Exception):
    """Error: the sources of a kernel cannot be determined from the present files."""


class ModuleSource(NamedTuple):
    """Source file of a module, with its digest and its imports."""

    path: Path
    digest: str
    """SHA-256 of the file's content."""
    imports: frozenset[str]
    """Names of imported modules, and of imported objects that could be modules."""


def sources(modules: Iterable[str]) -> dict[str, ModuleSource]:
    """Return the sources of modules and of everything that they import, by module name.

    Imports for type checkers, and of the standard library, are omitted. For other installed
    packages, see ``versions``.

    Raises
    ------
    NotOfSources
        A module has no source file; or its file was changed after the start of this process, and
        may differ from the imported version.
    """
    by_module: dict[str, ModuleSource] = {}
    tops = frozenset(module.partition(".")[0] for module in modules)
    ahead = sorted(set(modules))
    while ahead:
        module = ahead.pop()
        if module not in by_module:
            by_module[module] = _source(module)
            ahead += [name for name, version in _imported(module, tops) if not version]
    return dict(sorted(by_module.items()))


def versions(modules: Iterable[str]) -> dict[str, str]:
    """Return the versions of Python and of other packages that modules import.

    Parameters
    ----------
    modules
        Result of ``sources``.
    """
    tops = frozenset(module.partition(".")[0] for module in modules)
    versions_by_name = {
        name.partition(".")[0]: version
        for module in modules
        for name, version in _imported(module, tops)
        if version
    }
    return {"python": sys.version, **dict(sorted(versions_by_name.items()))}


@functools.cache
def _imported(module: str, tops: frozenset[str]) -> tuple[tuple[str, str], ...]:
    """Return the modules that a module imports, with the versions of installed packages."""
    names = []
    for name in sorted(_source(module).imports):
        top = name.partition(".")[0]
        if top in sys.stdlib_module_names:
            continue
        version = "" if top in tops else _version(top)
        if version or _file(name):
            names.append((name, version))
    return tuple(names)


@functools.cache
def _version(package: str) -> str:
    """Return the version of an installed package; empty if the import is not such a package."""
    file = _file(package)
    if file is None or file.name != "__init__.py":
        return ""
    installed = _named_as(package, file) or _recording(file)
    return installed.version if installed is not None else ""


def _named_as(package: str, file: Path) -> metadata.Distribution | None:
    """Return the distribution named like a package, if it contains the package's file."""
    try:
        distribution = metadata.distribution(package)
    except metadata.PackageNotFoundError:
        return None
    return (
        distribution
        if Path(str(distribution.locate_file(package))).resolve() in file.parents
        else None
    )


def _recording(file: Path) -> metadata.Distribution | None:
    """Return the distribution that lists a package's file, for names that differ (yaml: PyYAML)."""
    place = file.parents[1]
    line = f"\n{file.relative_to(place).as_posix()},".encode()
    for record in place.glob("*.dist-info/RECORD"):
        if line in b"\n" + record.read_bytes():
            return metadata.Distribution.at(record.parent)
    return None


@functools.cache
def _file(module: str) -> Path | None:
    try:
        spec = importlib.util.find_spec(module)
    except (ImportError, ValueError):
        return None  # an object in a module, not a module
    if spec is None or not spec.has_location or spec.origin is None:
        return None
    return Path(spec.origin).resolve()


def _source(module: str) -> ModuleSource:
    """Return the source of a module; refuse a file that has changed since the process started."""
    path = None if module == "__main__" else _file(module)
    if path is None:
        raise NotOfSources(f"{module} has no file to import it from")
    try:
        source = _read(module, path)
        # ctime is the time of the last change, which programs cannot set, except on Windows, where
        # it is that of the creation. It is read each time, because an edited module may be imported
        # again.
        status = path.stat()
        changed = status.st_mtime if sys.platform == "win32" else status.st_ctime
    except OSError as error:
        raise NotOfSources(str(error)) from error
    if changed > _process_start():
        raise NotOfSources(f"{path} is newer than this process")
    return source


@functools.cache
def _read(module: str, path: Path) -> ModuleSource:
    content = path.read_bytes()
    imports = _imports(content, module, path) if path.suffix == ".py" else frozenset[str]()
    return ModuleSource(path, hashlib.sha256(content).hexdigest(), imports)


def _imports(content: bytes, module: str, path: Path) -> frozenset[str]:
    """Return the names in a module's import statements, except those for type checkers."""
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    names: set[str] = set()
    ahead: list[ast.AST] = [ast.parse(content)]
    while ahead:
        node = ahead.pop()
        if isinstance(node, ast.If) and ast.unparse(node.test) in _TYPES_ONLY:
            ahead += node.orelse
            continue
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = "." * node.level + (node.module or "")
            base = importlib.util.resolve_name(base, package)
            names.update((base, *(f"{base}.{alias.name}" for alias in node.names)))
        for part in ("body", "orelse", "finalbody", "handlers", "cases"):
            ahead += getattr(node, part, [])
    return frozenset(names)


@functools.cache
def _process_start() -> float:
    """Return the start time of the process [s since the epoch], rounded up to a clock tick.

    On Linux, the time that psutil returns is up to a second early, because it is computed from the
    time of boot in whole seconds.
    """
    if sys.platform != "linux":
        import psutil

        return psutil.Process().create_time()
    status = Path("/proc/self/stat").read_text(encoding="utf-8")
    fields = status.rpartition(")")[2].split()
    ticks = os.sysconf("SC_CLK_TCK")
    age = time.clock_gettime(time.CLOCK_BOOTTIME) - (float(fields[19]) + 1.0) / ticks
    return time.time() - age
