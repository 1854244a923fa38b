"""Call in a process on another machine, which must have the same sources and versions.

The call consists of bytes; unpickling them performs the call and returns bytes. An intermediary
therefore does not need ab_sim, and a process without ab_sim fails like any call.
"""

import functools
import hashlib
import importlib
import io
import json
import pickle
import socket
import sys
import threading
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple, TypeVar

import ab_sim
from ab_sim.analysis.result_cache import sources_and_versions
from ab_sim.base.sources import NotOfSources

Thing = TypeVar("Thing")


class Done(NamedTuple):
    """Results of the calls."""

    results: Sequence[Any]


class Raised(NamedTuple):
    """Exception of a call."""

    error: Exception


class Differs(NamedTuple):
    """Refusal: the process has other sources or versions, and nothing was called."""

    host: str
    made_of: dict[str, str]
    """Sources and versions of the process, see ``RemoteCall.made_of``."""


Answer = Done | Raised | Differs


class RemoteCall:
    """Function to be called in another process with many items.

    Args:
        function: module-level function, or a partial of one.
        modules: further modules that results depend on, besides those of the function and its
            arguments; the other process imports them.

    Raises:
        NotOfSources: the sources of this process are unknown.
    """

    def __init__(self, function: Callable[[Thing], Any], modules: Iterable[str] = ()) -> None:
        home = function.func if isinstance(function, functools.partial) else function
        self._function = function
        installed = sys.stdlib_module_names | _versions(home.__module__)
        named = {
            module
            for module in _modules_in(pickle.dumps(function))
            if module.partition(".")[0] not in installed
        }
        self._modules = frozenset([home.__module__, *modules, *named])
        self.made_of = _made_of(self._modules)
        """Digests and versions that results depend on, by name."""

    def task(self, items: Sequence[Any]) -> bytes:
        """Return bytes; unpickling them calls the function with each item and returns an answer."""
        work = pickle.dumps((self._function, list(items)))
        return pickle.dumps(_Call(answer, self._modules, _fingerprint(self._modules), work))

    def differences(self, other: Differs) -> str:
        """Describe the differences of sources and versions from another process."""
        names = sorted(self.made_of.keys() | other.made_of.keys())
        named = [name for name in names if self.made_of.get(name) != other.made_of.get(name)]
        versions = [
            f"{name} {other.made_of.get(name, 'none')}, here {self.made_of.get(name, 'none')}"
            for name in named
            if name.startswith(_INSTALLED)
        ]
        own_names = [name for name in named if not name.startswith(_INSTALLED)]
        if own_names:
            more = f" and {len(own_names) - 1} others" if len(own_names) > 1 else ""
            versions.append(f"another source of {own_names[0]}{more}")
        return "; ".join(versions).replace(_INSTALLED, "")


_INSTALLED = "installed "
_ONE = threading.Lock()
"""Lock for worker threads, because Python 3.11 cannot parse in two threads at a time."""


class _Call:
    """Object that performs a call when it is unpickled."""

    def __init__(self, function: Callable[..., Any], *arguments: Any) -> None:
        self._call = function, arguments

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        return self._call


def answer(modules: frozenset[str], fingerprint: str, work: bytes) -> bytes:
    """Return a pickled ``Answer``; it runs in the other process.

    Args:
        modules: see ``RemoteCall``.
        fingerprint: fingerprint of sources and versions in the requesting process.
        work: pickled function and its items.
    """
    try:
        with _ONE:
            same = _fingerprint(modules) == fingerprint
    except NotOfSources as reason:
        return pickle.dumps(Differs(socket.gethostname(), {str(reason): ""}))
    if not same:
        return pickle.dumps(Differs(socket.gethostname(), _made_of(modules)))
    try:
        for module in modules:
            importlib.import_module(module)  # registers its metrics and effects
        function, items = pickle.loads(work)
        return pickle.dumps(Done([function(item) for item in items]))
    except Exception as error:
        return pickle.dumps(Raised(error))


def _modules_in(pickled: bytes) -> set[str]:
    """Return the modules of classes and functions in a pickle."""
    modules: set[str] = set()

    class Seen(pickle.Unpickler):
        def find_class(self, module: str, name: str) -> Any:
            modules.add(module)
            return super().find_class(module, name)

    Seen(io.BytesIO(pickled)).load()
    return modules


def _versions(module: str) -> set[str]:
    """Return the names of third-party packages on which a module depends."""
    return set(sources_and_versions(frozenset([module]))[1])


@functools.cache
def _made_of(modules: frozenset[str]) -> dict[str, str]:
    digests, versions = sources_and_versions(modules)
    return {
        f"{_INSTALLED}ab_sim": ab_sim.__version__,
        **{f"{_INSTALLED}{name}": version for name, version in versions.items()},
        **digests,
    }


@functools.cache
def _fingerprint(modules: frozenset[str]) -> str:
    content = json.dumps(_made_of(modules), sort_keys=True)
    return hashlib.sha256(content.encode()).hexdigest()
