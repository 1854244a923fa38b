"""Work on other machines through an existing Dask cluster.

A task is a pickle; unpickling it does the work. The scheduler therefore does not need ab_sim, and a
worker without ab_sim fails like any task. Each worker first compares its sources and versions with
those of the requesting process, because results are stored under exactly these.
"""

import contextlib
import functools
import hashlib
import importlib
import importlib.util
import json
import logging
import math
import pickle
import queue
import socket
import threading
import time
import uuid
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import islice
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar
from urllib.parse import urlsplit

from ab_sim.analysis.result_cache import sources_and_versions
from ab_sim.base.errors import AbSimError, InputError, short, visible
from ab_sim.base.plug_ins import GROUP, LOAD, loaded_files
from ab_sim.base.sources import NotOfSources
from ab_sim.base.version import __version__
from ab_sim.base.workers import KEPT, WorkerLost

if TYPE_CHECKING:
    from distributed import Client, Future


ANSWERS = 20.0
"""Timeout of a scheduler's answer [s]; on a busy machine 10 s were too short."""
_IN_FLIGHT = 3
"""Number of calls in flight per worker thread, so that no worker waits for this process."""
_LOOKS = 1.0
"""Interval between polls of the number of workers and of interrupts [s]."""
_ARRIVES = 40.0
"""Timeout of the transfer of a result from its worker [s]."""
_LEAVES = 3.0
"""Timeout of the disconnection from a scheduler [s]."""
_LOGGERS = ("asyncio", "distributed", "tornado")
"""Loggers whose messages are suppressed."""

Item = TypeVar("Item")
Result = TypeVar("Result")
_INSTALLED = "installed "
"""Prefix of names of packages among sources and versions."""
_PARSER_LOCK = threading.Lock()
"""Lock for worker threads, because Python 3.11 cannot parse in two threads at a time."""
Waiting = Callable[[str | None], None]
"""Callback for each second without a result.

Its argument is the reason of the wait; None if workers are computing. An exception in it ends the
work.
"""


class ClusterUnusable(AbSimError):
    """Error: no cluster answers, or its ab_sim is absent or different; the message has a remedy."""

    exit_code = 1


class Cluster:
    """Workers of a Dask scheduler, a replacement of ``Workers`` and a context manager.

    It connects when there is work. Other workers take over the share of a lost one. Everyone with
    access to the scheduler can run any code on workers and on this machine, so it must be trusted.

    Parameters
    ----------
    address
        Address of the scheduler: ``HOST:PORT``, ``tcp://HOST:PORT`` or ``tls://HOST:PORT``, with
        certificates from Dask's configuration.

    Attributes
    ----------
    modules
        Modules that results depend on in addition to the function's; workers import them.
    waiting
        See ``Waiting``.

    Raises
    ------
    InputError
        The address is malformed, or Dask is not installed.
    """

    def __init__(self, address: str) -> None:
        self._address = checked_address(address)
        if importlib.util.find_spec("distributed") is None:
            raise InputError("a scheduler needs Dask: pip install 'ab_sim[cluster]'")
        if files := loaded_files():
            raise InputError(
                f"{LOAD} {files[0]}: workers of a scheduler do not have the file; install a "
                f"package with the entry point {GROUP} there and here"
            )
        self.modules: Iterable[str] = ()
        self.waiting: Waiting | None = None
        self._client: Client | None = None
        self._threads, self._looked = 0, -math.inf
        self._news = threading.Event()
        self._ends = contextlib.ExitStack()

    def __enter__(self) -> "Cluster":
        return self

    def __exit__(self, *_: object) -> None:
        self._ends.close()

    def each(self, function: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[Result]:
        """Yield results in the order of the items.

        Parameters
        ----------
        function
            Module-level function, or a partial of one.
        items
            Arguments of the calls; each is read when it is sent.

        Raises
        ------
        ClusterUnusable
            No scheduler answers, or a worker has no ab_sim or a different one.
        WorkerLost
            The scheduler is gone, or a call repeatedly terminates its worker.
        """
        if not items:
            return
        try:
            home = function.func if isinstance(function, functools.partial) else function
            modules = frozenset([home.__module__, *self.modules])
            fingerprint = _fingerprint(modules)
        except NotOfSources as reason:
            raise ClusterUnusable(
                f"workers cannot be compared with this process: {reason}"
            ) from reason
        client = self._connected()
        # A few calls per worker thread are in flight, so that no worker waits for this process and
        # few calls are lost at an interrupt. Results are yielded in the order of the items.
        waiting = iter(items)
        flying: deque[Future] = deque()
        while True:
            room = max(0, _IN_FLIGHT * max(1, self._threads_now(client)) - len(flying))
            for item in islice(waiting, room):
                work = pickle.dumps((function, item))
                task = pickle.dumps(_Call(_result_of, modules, fingerprint, work))
                flying.append(self._sent(client, task))
            if not flying:
                return
            self._news.wait(_LOOKS)
            self._news.clear()
            for result in self._finished(client, flying):
                if isinstance(result, Differs):
                    raise ClusterUnusable(
                        f"the worker on {result.host} would not give the same bits: "
                        f"{_differences(_made_of(modules), result.made_of)}; install the same "
                        "versions there as here, and restart it"
                    )
                if isinstance(result, Exception):
                    raise result
                yield result

    def _connected(self) -> "Client":
        """Return the client, connecting at the first call.

        Raises
        ------
        ClusterUnusable
            No scheduler answers.
        """
        if self._client is None:
            from distributed import Client

            self._ends.enter_context(_silence())  # after the import, which configures logging
            clients: queue.SimpleQueue[Client | Exception] = queue.SimpleQueue()

            def connect() -> None:
                try:
                    clients.put(Client(self._address, timeout=ANSWERS, set_as_default=False))
                except Exception as error:  # another service may listen there
                    clients.put(error)

            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # version warnings: compared by ab_sim
                # Connect in a thread: another service at this address might never answer.
                threading.Thread(target=connect, daemon=True).start()
                client = self._first(clients)
            if isinstance(client, Exception):
                raise ClusterUnusable(
                    f"{self._address}: no Dask scheduler answers: {_reason(client)}"
                ) from client
            self._client = client
            self._ends.callback(_disconnect, self._client)
        return self._client

    def _first(self, clients: "queue.SimpleQueue[Client | Exception]") -> "Client | Exception":
        """Wait until the connecting thread delivers a client or an error, and return that."""
        until = time.monotonic() + ANSWERS + _LEAVES
        while time.monotonic() < until:
            with contextlib.suppress(queue.Empty):
                return clients.get(timeout=_LOOKS)
            if self.waiting is not None:
                self.waiting(f"waiting for the scheduler at {self._address}")
        return TimeoutError(f"nothing for {ANSWERS:g} s")

    def _threads_now(self, client: "Client") -> int:
        """Return the number of threads of all workers, at most a second old."""
        if time.monotonic() - self._looked > _LOOKS:
            with self._lost_with(client):
                self._threads = sum(client.nthreads().values())
            self._looked = time.monotonic()
        return self._threads

    def _sent(self, client: "Client", task: bytes) -> "Future":
        """Submit a pickled call, which a worker performs by unpickling it."""
        with self._lost_with(client):
            # The key identifies the owner; without a key Dask would hash the bytes.
            future = client.submit(pickle.loads, task, key=f"ab_sim-{uuid.uuid4().hex}", pure=False)
            future.add_done_callback(lambda _: self._news.set())
        return future

    def _finished(self, client: "Client", flying: "deque[Future]") -> list[Any]:
        """Remove the finished tasks at the front of the queue, and return their results.

        Raises
        ------
        WorkerLost
            The scheduler is gone, a worker was lost for good, or a result does not arrive.
        ClusterUnusable
            A worker has no ab_sim.
        """
        from distributed import TimeoutError as Late

        finished: list[Any] = []
        while flying and flying[0].status == "finished":
            with self._lost_with(client):
                try:
                    finished.append(flying[0].result(timeout=_ARRIVES))
                except Late as error:
                    if flying[0].status != "finished":
                        break  # lost with its worker and computed again
                    raise WorkerLost(
                        f"a worker's result has not arrived within {_ARRIVES:g} s: can the "
                        f"scheduler at {self._address} reach its workers? {KEPT}"
                    ) from error
            flying.popleft()
        if finished:
            return finished
        if flying[0].status == "error":
            raise _failure(flying[0].exception())
        if flying[0].status == "cancelled":  # the connection broke
            raise self._lost()
        if self.waiting is not None:
            self.waiting(None if self._threads else f"waiting for workers at {self._address}")
        return []

    @contextlib.contextmanager
    def _lost_with(self, client: "Client") -> Iterator[None]:
        """Turn errors of a broken connection within the ``with`` block into ``WorkerLost``."""
        from distributed import CancelledError

        try:
            yield
        except AbSimError:
            raise
        except (OSError, CancelledError) as error:
            raise self._lost() from error
        except Exception as error:
            # Dask raises many kinds of errors when a connection breaks; its status tells.
            if client.status == "running":
                raise
            raise self._lost() from error

    def _lost(self) -> WorkerLost:
        """Return the error of a lost scheduler."""
        return WorkerLost(f"the scheduler at {self._address} is gone; {KEPT}")


def checked_address(text: str) -> str:
    """Return a scheduler's address, with the protocol in front.

    Raises
    ------
    InputError
        The text is not the address of a scheduler.
    """
    whole = text if "://" in text else f"tcp://{text}"
    try:
        parts = urlsplit(whole)
        right = bool(parts.scheme in ("tcp", "tls") and parts.hostname and parts.port)
    except ValueError:
        right = False
    if not right or whole != f"{parts.scheme}://{parts.netloc}" or not whole.isprintable():
        raise InputError(
            f"scheduler {short(text)}: must be HOST:PORT, tcp://HOST:PORT or tls://HOST:PORT, "
            "e.g. tcp://10.0.0.1:8786"
        )
    return whole


def _failure(error: BaseException | None) -> AbSimError:
    """Return the error for a task that Dask has given up."""
    from distributed import KilledWorker

    if isinstance(error, KilledWorker):
        return WorkerLost(
            f"the same call has terminated {error.allowed_failures + 1} workers, by a signal or "
            f"for lack of memory; {KEPT}"
        )
    if isinstance(error, ImportError | AttributeError):
        return ClusterUnusable(
            f"a worker has no ab_sim, or a different one: {_reason(error)}; install ab_sim "
            f"{__version__} there"
        )
    return WorkerLost(f"a worker could not answer: {_reason(error)}; {KEPT}")


def _reason(error: BaseException | None) -> str:
    """Return the first line of an error's message."""
    lines = str(error).splitlines() or [""]
    return visible(lines[0].strip().rstrip(".") or type(error).__name__)


def _disconnect(client: "Client") -> None:
    """Disconnect a client; calls in flight are abandoned, and a lost scheduler is ignored."""
    with contextlib.suppress(Exception):
        client.close(timeout=_LEAVES)


@contextlib.contextmanager
def _silence() -> Iterator[None]:
    """Silence Dask's loggers within the ``with`` block.

    Errors are reported by this module, with their meaning for the work.
    """
    names = [*_LOGGERS, *logging.root.manager.loggerDict]
    loggers = [logging.getLogger(name) for name in names if name.partition(".")[0] in _LOGGERS]
    before = [(logger, logger.level) for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in before:
            logger.setLevel(level)


class Differs(NamedTuple):
    """Refusal of a worker with other sources or versions, which has called nothing."""

    host: str
    """Host name of the worker."""
    made_of: dict[str, str]
    """Sources and versions of the worker, by name."""


class _Call:
    """Object that performs a call when it is unpickled."""

    def __init__(self, function: Callable[..., Any], *arguments: Any) -> None:
        self._call = function, arguments

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        return self._call


def _result_of(modules: frozenset[str], fingerprint: str, work: bytes) -> Any:
    """Perform a task on a worker.

    An exception of the call is returned. An exception that is raised therefore concerns the worker
    itself, for example if ab_sim is not installed there.

    Parameters
    ----------
    modules
        Modules that results depend on.
    fingerprint
        Fingerprint of sources and versions in the requesting process.
    work
        Pickled function and its argument.

    Returns
    -------
    Any
        Result, or the exception of the call, or the refusal ``Differs`` of a worker with other
        sources.
    """
    try:
        with _PARSER_LOCK:
            same = _fingerprint(modules) == fingerprint
    except NotOfSources as reason:
        return Differs(socket.gethostname(), {str(reason): ""})
    if not same:
        return Differs(socket.gethostname(), _made_of(modules))
    try:
        for module in modules:
            importlib.import_module(module)  # registers its metrics and effects
        function, item = pickle.loads(work)
        return function(item)
    except Exception as error:
        return error


def _differences(here: dict[str, str], there: dict[str, str]) -> str:
    """Describe how sources and versions of a worker differ from those of this process, by name."""
    names = sorted(here.keys() | there.keys())
    named = [name for name in names if here.get(name) != there.get(name)]
    versions = [
        f"{name} {there.get(name, 'none')}, here {here.get(name, 'none')}"
        for name in named
        if name.startswith(_INSTALLED)
    ]
    sources = [name for name in named if not name.startswith(_INSTALLED)]
    if sources:
        more = f" and {len(sources) - 1} others" if len(sources) > 1 else ""
        versions.append(f"another source of {sources[0]}{more}")
    return "; ".join(versions).replace(_INSTALLED, "")


@functools.cache
def _made_of(modules: frozenset[str]) -> dict[str, str]:
    """Return digests of sources and versions of packages on which modules depend, by name."""
    digests, versions = sources_and_versions(modules)
    return {
        f"{_INSTALLED}ab_sim": __version__,
        **{f"{_INSTALLED}{name}": version for name, version in versions.items()},
        **digests,
    }


@functools.cache
def _fingerprint(modules: frozenset[str]) -> str:
    """Return a hash of ``_made_of``, short enough to be part of every task."""
    content = json.dumps(_made_of(modules), sort_keys=True)
    return hashlib.sha256(content.encode()).hexdigest()
