"""Results of long work, kept on disk by all that they follow from.

What is asked again is there at once, and work done piece by piece, each piece kept by itself, goes
on where it was interrupted. A file is named by a hash of what computes it, its scene, its numbers,
and the sources and versions that it is made of, found by imports
(``ab_sim.sources``): no result can be stale. What is read has to prove that it was written for
exactly that, else it is computed anew.
"""

import functools
import hashlib
import json
import logging
import pkgutil
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import ab_sim
from ab_sim.cache_folder import cache_folder
from ab_sim.integrate import steppers as steppers_folder
from ab_sim.integrate.registry import steppers
from ab_sim.output_file import write_whole
from ab_sim.quoting import visible
from ab_sim.scene.model import Scene
from ab_sim.sources import NotOfSources, sources, versions

Result = dict[str, Any]
"""JSON-able: mappings, lists, texts, finite numbers, booleans, None."""


class Results:
    """The results of one function: ``function(scene, **numbers)``.

    Two processes may use them at once: a file is there as a whole or not at all.

    Args:
        function: of a module; it takes a scene and JSON-able numbers by name, and gives a mapping
            that JSON can hold: no NaN, no infinity.
        folder: where; by default the user's, see ``results_folder``.
    """

    def __init__(self, function: Callable[..., Result], folder: Path | None = None) -> None:
        self._function = function
        self._folder = folder or results_folder()

    def of(self, scene: Scene, **numbers: Any) -> Result:
        """What the function gives, as JSON gives it back: as it was kept, or computed and kept."""
        found = self.find(scene, **numbers)
        if found is None:
            found = self.keep(self._function(scene, **numbers), scene, **numbers)
        return found

    def find(self, scene: Scene, **numbers: Any) -> Result | None:
        """What was kept; None if nothing was, or it cannot be believed."""
        key, file = self._key_and_file(scene, numbers)
        if file is None:
            return None
        try:
            entry = json.loads(file.read_bytes())
            result = entry["result"]
            sound = entry["seal"] == _seal(key, result)
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            return None
        return result if sound and isinstance(result, dict) else None

    def keep(self, result: Result, scene: Scene, **numbers: Any) -> Result:
        """Keep what the function gave; where that cannot be, one line says so, and all goes on.

        Returns:
            The result as JSON gives it back: what ``find`` finds.

        Raises:
            ValueError: JSON has no such number (NaN, infinite).
        """
        key, file = self._key_and_file(scene, numbers)
        result = json.loads(_canonical(result))
        if file is not None:
            entry = _canonical({"seal": _seal(key, result), "result": result})
            try:
                write_whole(file, entry.encode())
            except OSError as error:
                _say(f"{file.parent}: results cannot be kept there: {error.strerror}")
        return result

    def folder_of(self, scene: Scene, modules: Iterable[str], **numbers: Any) -> Path | None:
        """A folder, not made yet, for results that come in parts; None if there is no place.

        Whoever puts parts there has to see that they can be believed.

        Args:
            scene, numbers: see ``of``.
            modules: whose code computes them, too.
        """
        _, file = self._key_and_file(scene, numbers, modules)
        return file and file.with_suffix("")

    def _key_and_file(
        self, scene: Scene, numbers: Mapping[str, Any], modules: Iterable[str] = ()
    ) -> tuple[str, Path | None]:
        """All that a result follows from, and the file named by it."""
        what = f"{self._function.__module__}.{self._function.__qualname__}"
        effects = (type(each).__module__ for each in scene.effects.values())
        try:
            made_of = sources_and_versions(
                frozenset([self._function.__module__, *effects, *modules])
            )
        except NotOfSources as reason:
            _say(f"results are not kept: {reason}")
            return "", None
        content = [what, scene.as_mapping(), numbers, ab_sim.__version__, made_of]
        key = hashlib.sha256(_canonical(content).encode()).hexdigest()
        if self._folder is None:
            return key, None
        return key, self._folder / f"{self._function.__name__}-{key[:32]}.json"


@functools.cache
def results_folder() -> Path | None:
    """The user's folder of results, made if need be; None if there is no safe place for one."""
    folder = cache_folder()
    if folder is None:
        _say(
            "results are not kept: there is no folder that only you can write in; name one in "
            "the environment variable XDG_CACHE_HOME"
        )
    return folder


def sources_and_versions(modules: frozenset[str]) -> tuple[dict[str, str], dict[str, str]]:
    """What results of modules follow from, in this process.

    Returns:
        Digests of the sources of the modules, of all that these import, and of the steppers, which
        are found by their folder; versions of Python and of others' packages. Both by name.

    Raises:
        NotOfSources: see ``sources``.
    """
    beside = [found.name for found in pkgutil.iter_modules(steppers_folder.__path__)]
    kinds = {type(stepper.weights).__module__ for stepper in steppers().values()}
    homes = {*modules, *kinds, *(f"{steppers_folder.__name__}.{name}" for name in beside)}
    found = sources(homes)
    return {name: source.digest for name, source in found.items()}, versions(found)


def _seal(key: str, result: Result) -> str:
    """What only this result has if it is to be found under this key."""
    return hashlib.sha256(f"{key}{_canonical(result)}".encode()).hexdigest()


def _canonical(value: Any) -> str:
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)


@functools.cache
def _say(line: str) -> None:
    """Once: a line on standard error, unless a program has its own use of Python's logging."""
    logging.getLogger("ab_sim").warning(visible(line))
