"""Disk cache of results of long computations, keyed by all their inputs.

Repeated requests are served from the cache. Work that is done in blocks, each stored separately,
continues after an interruption. A file name is a hash of the function, the scene, the numbers, and
the sources and versions in use, which are found through imports (``ab_sim.base.sources``). Results
are therefore never stale. A stored file must carry a digest that matches its key; otherwise the
result is computed again.
"""

import functools
import hashlib
import json
import logging
import pkgutil
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from ab_sim.analysis.maps.refine import Point
from ab_sim.base.errors import visible
from ab_sim.base.files import cache_folder, write_whole
from ab_sim.base.presentation import Progress
from ab_sim.base.sources import NotOfSources, sources, versions
from ab_sim.base.version import __version__
from ab_sim.engine.integrate import steppers as steppers_folder
from ab_sim.engine.integrate.registry import steppers
from ab_sim.scene.model import Scene

Result = dict[str, Any]
"""JSON-able mapping: mappings, lists, texts, finite numbers, booleans, None."""


class ResultCache:
    """Cached results of one function: ``function(scene, **numbers)``.

    Processes may share the cache: files are written atomically.

    Parameters
    ----------
    function
        Module-level function of a scene and JSON-able keyword arguments; it returns a mapping that
        JSON can represent, without NaN and infinity.
    folder
        Cache folder; by default the user's, see ``results_folder``.
    """

    def __init__(self, function: Callable[..., Result], folder: Path | None = None) -> None:
        self._function = function
        self._folder = folder or results_folder()

    def of(self, scene: Scene, **numbers: Any) -> Result:
        """Return the function's result after a JSON round trip, cached or computed."""
        cached = self.find(scene, **numbers)
        if cached is None:
            cached = self.keep(self._function(scene, **numbers), scene, **numbers)
        return cached

    def find(self, scene: Scene, **numbers: Any) -> Result | None:
        """Return the stored result; None if there is none or its digest does not match."""
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
        """Store a result; log one line and continue if that is not possible.

        Returns
        -------
        Result
            The result after a JSON round trip, as ``find`` returns it.

        Raises
        ------
        ValueError
            The result contains NaN or infinity.
        """
        key, file = self._key_and_file(scene, numbers)
        result = json.loads(_canonical(result))
        if file is not None:
            entry = _canonical({"seal": _seal(key, result), "result": result})
            try:
                write_whole(file, entry.encode())
            except OSError as error:
                warn_once(f"{file.parent}: results cannot be stored there: {error.strerror}")
        return result

    def folder_of(self, scene: Scene, modules: Iterable[str], **numbers: Any) -> Path | None:
        """Return a folder for results in parts, not yet created; None if there is no place for it.

        The caller has to verify the parts that it reads.

        Parameters
        ----------
        scene, numbers
            See ``of``.
        modules
            Further modules whose code contributes to the result.
        """
        _, file = self._key_and_file(scene, numbers, modules)
        return file and file.with_suffix("")

    def _key_and_file(
        self, scene: Scene, numbers: Mapping[str, Any], modules: Iterable[str] = ()
    ) -> tuple[str, Path | None]:
        """Return the key of a result, a hash of all its inputs, and the file named by it.

        The key is empty if the sources cannot be determined; the file is None if there is no place
        for it.
        """
        what = f"{self._function.__module__}.{self._function.__qualname__}"
        effects = (type(effect).__module__ for effect in scene.effects.values())
        try:
            origins = sources_and_versions(
                frozenset([self._function.__module__, *effects, *modules])
            )
        except NotOfSources as reason:
            warn_once(f"results are not cached: {reason}")
            return "", None
        content = [what, scene.as_mapping(), numbers, __version__, origins]
        key = hashlib.sha256(_canonical(content).encode()).hexdigest()
        if self._folder is None:
            return key, None
        return key, self._folder / f"{self._function.__name__}-{key[:32]}.json"


@functools.cache
def results_folder() -> Path | None:
    """Return the user's cache folder, created if needed; None if there is no safe place."""
    folder = cache_folder()
    if folder is None:
        logging.getLogger("ab_sim").warning(
            "results are not cached: no folder is writable by you alone; name one in the "
            "environment variable XDG_CACHE_HOME"
        )
    return folder


def sources_and_versions(modules: frozenset[str]) -> tuple[dict[str, str], dict[str, str]]:
    """Return the sources and versions on which results of modules depend.

    Returns
    -------
    tuple[dict[str, str], dict[str, str]]
        Digests of the sources of the modules, their imports and the steppers (found by folder), by
        name; versions of Python and third-party packages, by name.

    Raises
    ------
    NotOfSources
        See ``sources``.
    """
    beside = [module_info.name for module_info in pkgutil.iter_modules(steppers_folder.__path__)]
    kinds = {type(stepper.weights).__module__ for stepper in steppers().values()}
    homes = {*modules, *kinds, *(f"{steppers_folder.__name__}.{name}" for name in beside)}
    sources_by_name = sources(homes)
    return {name: source.digest for name, source in sources_by_name.items()}, versions(
        sources_by_name
    )


def _seal(key: str, result: Result) -> str:
    """Return the hash of key and result, which reveals a damaged or misplaced file."""
    return hashlib.sha256(f"{key}{_canonical(result)}".encode()).hexdigest()


def _canonical(value: Any) -> str:
    """Return JSON that is equal for equal values: sorted keys, no spaces; it refuses NaN."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)


@functools.cache
def warn_once(line: str) -> None:
    """Log a line once; it goes to standard error unless logging is configured."""
    logging.getLogger("ab_sim").warning(visible(line))


SAVE_INTERVAL = 20.0
"""Time between two checkpoints [s]: the most work that an interruption loses."""


class PointCheckpoint:
    """Computed values of a grid's points, saved periodically and at the end of the ``with`` block.

    Parameters
    ----------
    function
        Module-level function that computes the values; it names the checkpoint.
    scene
        Scene on which the values depend.
    numbers
        Further JSON-able arguments on which they depend, by name.
    """

    def __init__(self, function: Callable[..., Any], scene: Scene, numbers: dict[str, Any]) -> None:
        self._results, self._scene, self._numbers = ResultCache(function), scene, numbers
        stored = self._results.find(scene, **numbers) or {"points": []}
        self._values: dict[Point, Any] = {(i, j): value for i, j, value in stored["points"]}
        self._on_disk = len(self._values)
        self._saved_at = time.monotonic()

    def __enter__(self) -> "PointCheckpoint":
        return self

    def __exit__(self, *_: object) -> None:
        self._save()

    def _save(self) -> None:
        if len(self._values) > self._on_disk:
            points = [[*point, value] for point, value in self._values.items()]
            self._results.keep({"points": points}, self._scene, **self._numbers)
        self._on_disk, self._saved_at = len(self._values), time.monotonic()

    def of(
        self,
        points: Sequence[Point],
        compute: Callable[[Sequence[Point]], Iterable[Any]],
        what: str,
        tell: Progress | None = None,
    ) -> list[Any]:
        """Return the values of points; missing values are computed.

        Parameters
        ----------
        points
            Row and column of each point.
        compute
            Function that returns JSON-able values of points, one by one.
        what
            Name of the work, for ``tell``.
        tell
            Progress callback; an exception in it ends the work; computed points are saved.
        """
        wanted = [point for point in points if point not in self._values]
        before = len(self._values)
        most = before + len(wanted)
        if tell is not None:
            tell(what, before, most)
        for point, value in zip(wanted, compute(wanted), strict=True):
            self._values[point] = value
            if time.monotonic() - self._saved_at > SAVE_INTERVAL:
                self._save()
            if tell is not None:
                tell(what, len(self._values), most)
        return [self._values[point] for point in points]
