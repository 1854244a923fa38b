"""Plug-ins: code of users that registers effects, metrics, steppers and deck models.

An installed package names its modules in the entry-point group ``GROUP``. A single file
is named by ``ab-sim --load`` or a node's parameter ``load``, and never by a scene: scenes are data.
"""

import functools
import importlib.util
import pkgutil
import sys
import threading
from collections.abc import Callable, Iterable
from functools import partial
from importlib import metadata
from pathlib import Path

from ab_sim.base.errors import InputError

GROUP = "ab_sim.plug_ins"
"""Entry-point group of installed plug-ins."""
LOAD = "--load"
"""Option of ``ab-sim`` that names files."""
_files: dict[str, Path] = {}
"""Loaded files by module."""
_lock = threading.RLock()
_installed_begun = False


def load_installed() -> None:
    """Import the modules of the entry-point group, unless they have been imported.

    Every registry calls this function before it is read. A plug-in may read registries while it
    registers.

    Raises
    ------
    InputError
        A module cannot be imported; the message names its package.
    """
    global _installed_begun
    with _lock:
        if _installed_begun:
            return
        _installed_begun = True
        try:
            for point in sorted(metadata.entry_points(group=GROUP)):
                package = point.dist.name if point.dist is not None else "?"
                _run(
                    point.load,
                    f"plug-in {point.name} ({point.value}) of the installed package {package}",
                    "update or uninstall the package",
                )
        except InputError:
            _installed_begun = False  # so that the next reader gets the error, too
            raise


@functools.cache
def load_folder(package: str) -> None:
    """Import all modules of a package, which register their classes, and installed plug-ins."""
    for module_info in pkgutil.iter_modules(importlib.import_module(package).__path__):
        importlib.import_module(f"{package}.{module_info.name}")
    load_installed()


def load_files(files: Iterable[str | Path], option: str = LOAD) -> None:
    """Import plug-in files, each once.

    Parameters
    ----------
    files
        Python files; a module has the name of its file, without `.py`.
    option
        Option or parameter that names the files, for messages.

    Raises
    ------
    InputError
        A file does not exist, has the name of another module, or cannot be imported.
    """
    for file in files:
        path = Path(file).expanduser().resolve()
        name = path.stem
        if _files.get(name) == path:
            continue
        if path.suffix != ".py" or not name.isidentifier() or not path.is_file():
            raise InputError(
                f"{option} {file}: must be a Python file, e.g. my_effects.py, whose name without "
                ".py is a valid name in Python"
            )
        if name in sys.modules or _found_elsewhere(name, path):
            raise InputError(
                f"{option} {file}: another module is called {name}; give the file another name"
            )
        _run(partial(_import, name, path), f"{option} {file}", "correct the file")
        _files[name] = path


def loaded_files() -> tuple[str, ...]:
    """Return the files that ``load_files`` has imported, for worker processes."""
    return tuple(map(str, _files.values()))


def _found_elsewhere(name: str, path: Path) -> bool:
    """Return whether ``import name`` would import another file than ``path``."""
    spec = importlib.util.find_spec(name)
    return spec is not None and (spec.origin is None or Path(spec.origin).resolve() != path)


def _import(name: str, path: Path) -> None:
    """Import a file as the module ``name``."""
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # results and processes refer to its classes by this name
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise


def _run(load: Callable[[], object], what: str, remedy: str) -> None:
    """Call ``load``, and raise InputError with the name of the plug-in if it fails."""
    try:
        load()
    except Exception as error:
        reason = f"{type(error).__name__}: {error}"
        raise InputError(f"{what}: cannot be loaded: {reason}; {remedy}") from error
