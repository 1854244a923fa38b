"""A call in a process on another machine, which must have the same sources and versions.

It is bytes whose unpickling is the call, and bytes are its answer. So what passes it on need not
have ab_sim, and a process without ab_sim fails as any call can.
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
from ab_sim.analysis.results import sources_and_versions
from ab_sim.sources import NotOfSources

Thing = TypeVar("Thing")


class Done(NamedTuple):
    """What the function gave."""

    results: Sequence[Any]


class Raised(NamedTuple):
    """What the function raised."""

    error: Exception


class Differs(NamedTuple):
    """Nothing was called: the process is made of something else."""

    host: str
    made_of: dict[str, str]
    """See ``RemoteCall.made_of``."""


Answer = Done | Raised | Differs


class RemoteCall:
    """A function to be called elsewhere, with many items.

    Args:
        function: of a module, or partial of such a one.
        modules: which its results follow from beside its own and those of its arguments; the other
            process imports them.

    Raises:
        NotOfSources: this process cannot say what it is made of.
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
        """What its results follow from, a digest or version by name."""

    def task(self, items: Sequence[Any]) -> bytes:
        """Bytes: who unpickles them calls the function with each item, and has an answer."""
        work = pickle.dumps((self._function, list(items)))
        return pickle.dumps(_Call(answer, self._modules, _fingerprint(self._modules), work))

    def differences(self, other: Differs) -> str:
        """What another process is made of that this one is not, and the other way round."""
        names = sorted(self.made_of.keys() | other.made_of.keys())
        named = [name for name in names if self.made_of.get(name) != other.made_of.get(name)]
        versions = [
            f"{name} {other.made_of.get(name, 'none')}, here {self.made_of.get(name, 'none')}"
            for name in named
            if name.startswith(_INSTALLED)
        ]
        own = [name for name in named if not name.startswith(_INSTALLED)]
        if own:
            more = f" and {len(own) - 1} others" if len(own) > 1 else ""
            versions.append(f"another source of {own[0]}{more}")
        return "; ".join(versions).replace(_INSTALLED, "")


_INSTALLED = "installed "
_ONE = threading.Lock()
"""A worker may have several threads, and Python 3.11 cannot parse in two of them at a time."""


class _Call:
    """Pickled, it is a call: who unpickles it gets what the function gives."""

    def __init__(self, function: Callable[..., Any], *given: Any) -> None:
        self._call = function, given

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        return self._call


def answer(modules: frozenset[str], fingerprint: str, work: bytes) -> bytes:
    """A pickled ``Answer``, in the other process.

    Args:
        modules: see ``RemoteCall``.
        fingerprint: of what they are made of where the answer is wanted.
        work: a pickled function, and the items to call it with.
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
            importlib.import_module(module)  # registers what is in it
        function, items = pickle.loads(work)
        return pickle.dumps(Done([function(item) for item in items]))
    except Exception as error:
        return pickle.dumps(Raised(error))


def _modules_in(pickled: bytes) -> set[str]:
    """Those of classes and functions that a pickle names."""
    found: set[str] = set()

    class Seen(pickle.Unpickler):
        def find_class(self, module: str, name: str) -> Any:
            found.add(module)
            return super().find_class(module, name)

    Seen(io.BytesIO(pickled)).load()
    return found


def _versions(module: str) -> set[str]:
    """Names of others' packages that a module is made of."""
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
