"""Work on other machines through an existing Dask cluster.

Dask and its scheduler only see bytes. Each worker first compares its sources and versions with
those of the requesting process, because results are stored under exactly these.
"""

import contextlib
import importlib.util
import logging
import math
import pickle
import queue
import threading
import time
import uuid
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import islice
from typing import TYPE_CHECKING, Any, TypeVar
from urllib.parse import urlsplit

import ab_sim
from ab_sim.base.errors import AbSimError, InputError, short, visible
from ab_sim.base.plug_ins import GROUP, LOAD, loaded_files
from ab_sim.base.sources import NotOfSources
from ab_sim.base.workers import KEPT, WorkerLost
from ab_sim.design.remote_call import Answer, Differs, Done, Raised, RemoteCall

if TYPE_CHECKING:
    from distributed import Client, Future

ANSWERS = 20.0
"""Timeout of a scheduler's answer [s]; on a busy machine 10 s were too short."""
IN_FLIGHT = 3
"""Number of calls in flight per worker thread, so that no worker waits for this process."""
LOOKS = 1.0
"""Interval between polls of the number of workers and of interrupts [s]."""
ARRIVES = 40.0
"""Timeout of the transfer of a result from its worker [s]."""
LEAVES = 3.0
"""Timeout of the disconnection from a scheduler [s]."""
_LOGGERS = ("asyncio", "distributed", "tornado")

Thing = TypeVar("Thing")
Result = TypeVar("Result")
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

    Args:
        address: address of the scheduler: ``HOST:PORT``, ``tcp://HOST:PORT`` or
            ``tls://HOST:PORT``, with certificates from Dask's configuration.

    Attributes:
        modules: modules that results depend on in addition to the function's; workers import them.
        waiting: see ``Waiting``.

    Raises:
        InputError: the address is malformed, or Dask is not installed.
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

    def each(
        self,
        function: Callable[[Thing], Result],
        items: Sequence[Thing],
        chunk: int = 1,
    ) -> Iterator[Result]:
        """Yield results in the order of the items.

        Args:
            function: module-level function, or a partial of one.
            items: arguments of the calls; each is read when it is sent.
            chunk: number of items that a worker gets at a time.

        Raises:
            ClusterUnusable: no scheduler answers, or a worker has no ab_sim or a different one.
            WorkerLost: the scheduler is gone, or a call repeatedly terminates its worker.
        """
        if not items:
            return
        try:
            call = RemoteCall(function, self.modules)
        except NotOfSources as reason:
            raise ClusterUnusable(
                f"workers cannot be compared with this process: {reason}"
            ) from reason
        client = self._connected()
        parts = (items[k : k + chunk] for k in range(0, len(items), chunk))
        flying: deque[Future] = deque()
        while True:
            room = max(0, IN_FLIGHT * max(1, self._threads_now(client)) - len(flying))
            for part in islice(parts, room):
                flying.append(self._sent(client, call.task(part)))
            if not flying:
                return
            self._news.wait(LOOKS)
            self._news.clear()
            for answer in self._answers(client, flying):
                yield from _results(call, answer)

    def _connected(self) -> "Client":
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
            self._ends.callback(_take_leave, self._client)
        return self._client

    def _first(self, clients: "queue.SimpleQueue[Client | Exception]") -> "Client | Exception":
        until = time.monotonic() + ANSWERS + LEAVES
        while time.monotonic() < until:
            with contextlib.suppress(queue.Empty):
                return clients.get(timeout=LOOKS)
            if self.waiting is not None:
                self.waiting(f"waiting for the scheduler at {self._address}")
        return TimeoutError(f"nothing for {ANSWERS:g} s")

    def _threads_now(self, client: "Client") -> int:
        """Return the number of threads of all workers, at most a second old."""
        if time.monotonic() - self._looked > LOOKS:
            with self._lost_with(client):
                self._threads = sum(client.nthreads().values())
            self._looked = time.monotonic()
        return self._threads

    def _sent(self, client: "Client", task: bytes) -> "Future":
        with self._lost_with(client):
            # The key identifies the owner; without a key Dask would hash the bytes.
            future = client.submit(pickle.loads, task, key=f"ab_sim-{uuid.uuid4().hex}", pure=False)
            future.add_done_callback(lambda _: self._news.set())
        return future

    def _answers(self, client: "Client", flying: "deque[Future]") -> list[Answer]:
        """Remove and return the finished answers at the front of the queue."""
        from distributed import TimeoutError as Late

        answers: list[Answer] = []
        while flying and flying[0].status == "finished":
            with self._lost_with(client):
                try:
                    answers.append(pickle.loads(flying[0].result(timeout=ARRIVES)))
                except Late as error:
                    if flying[0].status != "finished":
                        break  # lost with its worker and computed again
                    raise WorkerLost(
                        f"a worker's result has not arrived within {ARRIVES:g} s: can the "
                        f"scheduler at {self._address} reach its workers? {KEPT}"
                    ) from error
            flying.popleft()
        if answers:
            return answers
        if flying[0].status == "error":
            raise _failure(flying[0].exception())
        if flying[0].status == "cancelled":  # the connection broke
            raise self._lost()
        if self.waiting is not None:
            self.waiting(None if self._threads else f"waiting for workers at {self._address}")
        return []

    @contextlib.contextmanager
    def _lost_with(self, client: "Client") -> Iterator[None]:
        from distributed import CancelledError

        try:
            yield
        except AbSimError:
            raise
        except (OSError, CancelledError) as error:
            raise self._lost() from error
        except Exception as error:
            if client.status == "running":
                raise
            raise self._lost() from error

    def _lost(self) -> WorkerLost:
        return WorkerLost(f"the scheduler at {self._address} is gone; {KEPT}")


def checked_address(text: str) -> str:
    """Return a scheduler's address with its protocol.

    Raises:
        InputError: the text is not the address of a scheduler.
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


def _results(call: RemoteCall, answer: Answer) -> Sequence[Any]:
    """Return the results of a worker's calls, or raise their exception."""
    match answer:
        case Done(results):
            return results
        case Raised(error):
            raise error
        case Differs(host, _):
            raise ClusterUnusable(
                f"the worker on {host} would not give the same bits: {call.differences(answer)}; "
                "install the same versions there as here, and restart it"
            )


def _failure(error: BaseException | None) -> AbSimError:
    """Return the error for a call that Dask has given up."""
    from distributed import KilledWorker

    if isinstance(error, KilledWorker):
        return WorkerLost(
            f"the same call has terminated {error.allowed_failures + 1} workers, by a signal or "
            f"for lack of memory; {KEPT}"
        )
    if isinstance(error, ImportError | AttributeError):
        return ClusterUnusable(
            f"a worker has no ab_sim, or a different one: {_reason(error)}; install ab_sim "
            f"{ab_sim.__version__} there"
        )
    return WorkerLost(f"a worker could not answer: {_reason(error)}; {KEPT}")


def _reason(error: BaseException | None) -> str:
    """Return the first line of an error's message."""
    lines = str(error).splitlines() or [""]
    return visible(lines[0].strip().rstrip(".") or type(error).__name__)


def _take_leave(client: "Client") -> None:
    """Disconnect; calls in flight are abandoned, and a lost scheduler is ignored."""
    with contextlib.suppress(Exception):
        client.close(timeout=LEAVES)


@contextlib.contextmanager
def _silence() -> Iterator[None]:
    """Silence Dask's loggers: its errors are reported here in terms of the work."""
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
