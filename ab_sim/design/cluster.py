"""Work on other machines: a Dask cluster that is there already.

Neither Dask nor its scheduler sees more of the work than bytes. Each worker compares its sources
and versions with those of the process that asks before it does anything: rows are kept as what
follows from exactly these.
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
from types import TracebackType
from typing import TYPE_CHECKING, Any, TypeVar
from urllib.parse import urlsplit

import ab_sim
from ab_sim.design.remote_call import Answer, Differs, Done, Raised, RemoteCall
from ab_sim.errors import AbSimError, InputError
from ab_sim.quoting import short, visible
from ab_sim.sources import NotOfSources
from ab_sim.workers import KEPT, WorkerLost

if TYPE_CHECKING:
    from distributed import Client, Future

ANSWERS = 20.0
"""s, within which a scheduler has to; on a busy machine 10 were too few."""
IN_FLIGHT = 3
"""Calls that are sent ahead for each thread of the workers: none waits for this process."""
LOOKS = 1.0
"""s between looks at how many workers there are, and at whether the work is to end."""
ARRIVES = 40.0
"""s that a result may take from its worker to here."""
LEAVES = 3.0
"""s that taking leave of a scheduler may take."""
_LOGGERS = ("asyncio", "distributed", "tornado")

Thing = TypeVar("Thing")
Result = TypeVar("Result")
Waiting = Callable[[str | None], None]
"""Called each second without a result, with what is waited for, if not for workers at work; what it
raises ends the work."""


class ClusterUnusable(AbSimError):
    """A cluster cannot do the work: there is none, or none with this ab_sim; says what to do."""

    exit_code = 1


class Cluster:
    """Workers of a Dask scheduler, in place of ``Workers``; to be used in a ``with``.

    It connects when there is work. Where a worker is lost, others do its share. Whoever can talk to
    the scheduler can run any code on workers and here: it has to be one to trust.

    Args:
        address: of the scheduler, ``HOST:PORT``, ``tcp://HOST:PORT`` or ``tls://HOST:PORT``, whose
            certificates Dask's configuration names.

    Attributes:
        modules: which results follow from beside the function's own; workers import them.
        waiting: see ``Waiting``.

    Raises:
        InputError: the address cannot be one, or Dask is not installed.
    """

    def __init__(self, address: str) -> None:
        self._address = checked_address(address)
        if importlib.util.find_spec("distributed") is None:
            raise InputError("a scheduler needs Dask: pip install 'ab_sim[cluster]'")
        self.modules: Iterable[str] = ()
        self.waiting: Waiting | None = None
        self._client: Client | None = None
        self._threads, self._looked = 0, -math.inf
        self._news = threading.Event()
        self._ends = contextlib.ExitStack()

    def __enter__(self) -> "Cluster":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._ends.close()

    def each(
        self,
        function: Callable[[Thing], Result],
        items: Sequence[Thing],
        chunk: int = 1,
    ) -> Iterator[Result]:
        """Results in the order of the items, as they are computed.

        Args:
            function: of a module, or partial of such a one.
            items: what it is called with; each is taken when it is sent.
            chunk: number of items that a worker gets at a time.

        Raises:
            ClusterUnusable: no scheduler answers, or a worker has no ab_sim, or another one.
            WorkerLost: the scheduler is gone, or workers end whenever they get a certain call.
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

            self._ends.enter_context(_silence())  # which the import would break
            made: queue.SimpleQueue[Client | Exception] = queue.SimpleQueue()

            def connect() -> None:
                try:
                    made.put(Client(self._address, timeout=ANSWERS, set_as_default=False))
                except Exception as error:  # whatever else may listen there
                    made.put(error)

            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of versions, which are compared here
                # By a thread: what else listens there may never answer.
                threading.Thread(target=connect, daemon=True).start()
                found = self._first(made)
            if isinstance(found, Exception):
                raise ClusterUnusable(
                    f"{self._address}: no Dask scheduler answers: {_reason(found)}"
                ) from found
            self._client = found
            self._ends.callback(_take_leave, self._client)
        return self._client

    def _first(self, made: "queue.SimpleQueue[Client | Exception]") -> "Client | Exception":
        until = time.monotonic() + ANSWERS + LEAVES
        while time.monotonic() < until:
            with contextlib.suppress(queue.Empty):
                return made.get(timeout=LOOKS)
            if self.waiting is not None:
                self.waiting(f"waiting for the scheduler at {self._address}")
        return TimeoutError(f"nothing for {ANSWERS:g} s")

    def _threads_now(self, client: "Client") -> int:
        """Of all workers, as of less than a second ago."""
        if time.monotonic() - self._looked > LOOKS:
            with self._lost_with(client):
                self._threads = sum(client.nthreads().values())
            self._looked = time.monotonic()
        return self._threads

    def _sent(self, client: "Client", task: bytes) -> "Future":
        with self._lost_with(client):
            # The key says whose it is; without one Dask would hash the bytes.
            future = client.submit(pickle.loads, task, key=f"ab_sim-{uuid.uuid4().hex}", pure=False)
            future.add_done_callback(lambda _: self._news.set())
        return future

    def _answers(self, client: "Client", flying: "deque[Future]") -> list[Answer]:
        """Those that are there of the first calls, which are taken out."""
        from distributed import TimeoutError as Late

        found: list[Answer] = []
        while flying and flying[0].status == "finished":
            with self._lost_with(client):
                try:
                    found.append(pickle.loads(flying[0].result(timeout=ARRIVES)))
                except Late as error:
                    if flying[0].status != "finished":
                        break  # it was lost with its worker, and is computed again
                    raise WorkerLost(
                        f"a worker's result has not arrived within {ARRIVES:g} s: can the "
                        f"scheduler at {self._address} reach its workers? {KEPT}"
                    ) from error
            flying.popleft()
        if found:
            return found
        if flying[0].status == "error":
            raise _failure(flying[0].exception())
        if flying[0].status == "cancelled":  # as all are when the connection breaks
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
    """A scheduler's address with its protocol.

    Raises:
        InputError: it cannot be one.
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
    """What a worker's calls gave; raises what they raised."""
    match answer:
        case Done(results):
            return results
        case Raised(error):
            raise error
        case Differs(host, _):
            raise ClusterUnusable(
                f"the worker on {host} would not give the same bits: {call.differences(answer)}; "
                "install there what is installed here, and start it again"
            )


def _failure(error: BaseException | None) -> AbSimError:
    """Why there is no answer to a call, which Dask has given up."""
    from distributed import KilledWorker

    if isinstance(error, KilledWorker):
        return WorkerLost(
            f"the same call has ended {error.allowed_failures + 1} workers, by a signal or for "
            f"want of memory; {KEPT}"
        )
    if isinstance(error, ImportError | AttributeError):
        return ClusterUnusable(
            f"a worker has no ab_sim, or another one: {_reason(error)}; install ab_sim "
            f"{ab_sim.__version__} there"
        )
    return WorkerLost(f"a worker could not answer: {_reason(error)}; {KEPT}")


def _reason(error: BaseException | None) -> str:
    """In a line."""
    lines = str(error).splitlines() or [""]
    return visible(lines[0].strip().rstrip(".") or type(error).__name__)


def _take_leave(client: "Client") -> None:
    """What is in flight is of no use any more; a scheduler that is gone hears nothing of it."""
    with contextlib.suppress(Exception):
        client.close(timeout=LEAVES)


@contextlib.contextmanager
def _silence() -> Iterator[None]:
    """Dask says nothing on its own: what its errors mean for the work is said here."""
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
