"""A node's life in its process: start, spin in a thread, clean end on Ctrl-C and SIGTERM."""

import contextlib
import ctypes
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

import rclpy
from rclpy.duration import Duration
from rclpy.experimental import EventsExecutor
from rclpy.node import Node

from ab_sim import interruption
from ab_sim.errors import AbSimError
from ab_sim.nodes.arguments import init_ros
from ab_sim.nodes.leaving import leave_graph
from ab_sim.quoting import visible

LINGER = 0.5
"""s."""
ENOUGH = 0.5
"""s for a callback to come to its end, when the node does."""
TURN = 0.5e-3
"""s for which a thread may keep Python's lock while another one waits for it. Python's own 5 ms are
more than a wake-up's period: a flood of requests would make the loop late by that."""
_ARENA_MAX = -8
"""M_ARENA_MAX of glibc's malloc.h."""
SomeNode = TypeVar("SomeNode", bound=Node)


def run_node(
    make: Callable[[], SomeNode],
    loop: Callable[[SomeNode, threading.Event], None],
    arguments: Sequence[str] | None = None,
) -> None:
    """Make a node, answer its callbacks in a thread, run ``loop``, and end the process.

    Bad input ends the process with one message and the error's exit code. Ctrl-C and SIGTERM end
    it at once while Python imports, with 128 + the signal's number; then in order, with 0, and a
    second one (``interruption.ONE_WISH``) at once.

    Args:
        make: makes the node; rclpy is initialised by then, and must not be before.
        loop: runs in the main thread until the event it is given is set. ROS still works then,
            so that it can publish what is left.
        arguments: the program and its arguments; default: those of the process.
    """
    interruption.watch()
    sys.setswitchinterval(TURN)
    code, left = 0, True
    try:
        init_ros(arguments)
        # From before there is a DDS participant: one that does not leave in order stays in the
        # graph of others until its lease ends, 20 s later.
        with interruption.in_order() as stopping:
            node = make()
            try:
                try:
                    with _answering(node, stopping):
                        loop(node, stopping)
                finally:  # an error's last words count most
                    _let_last_words_out(node)
            finally:
                left = leave_graph(node)
    except AbSimError as error:
        print(visible(str(error)), file=sys.stderr)
        code = error.exit_code
    finally:
        if left:
            rclpy.try_shutdown()
    interruption.leave(code)


def share_heaps() -> None:
    """Have further threads allocate from the heaps that there are, where the C library is glibc.

    It makes up to eight for each core, now and then another one, and what is freed in one of them
    serves no other: memory creeps for hours. Threads may then wait for each other: nothing for who
    must be on time.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(_ARENA_MAX, 1)


@contextlib.contextmanager
def _answering(node: Node, stopping: threading.Event) -> Iterator[None]:
    """Answer the node's callbacks in a thread; what one of them raises ends the process."""
    executor = EventsExecutor()
    executor.add_node(node)
    failures: list[BaseException] = []
    done = threading.Event()

    def spin() -> None:
        try:
            # Without a finite timeout this executor cannot be stopped.
            while not done.is_set():
                executor.spin_once(timeout_sec=0.2)
        except BaseException as failure:
            failures.append(failure)
            stopping.set()

    thread = threading.Thread(target=spin, name="callbacks", daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        executor.wake()
        thread.join(ENOUGH)
        # What is still being answered, as a scene that compiles, ends with the process.
        if not thread.is_alive():
            executor.shutdown()
    if failures:
        raise failures[0]


def _let_last_words_out(node: Node) -> None:
    """Wait until listeners have what was published, but no longer than ``LINGER`` in all.

    Acknowledgements may take a heartbeat's period, which is 3 s where ``discovery`` could not make
    it shorter; the samples themselves are mostly there long before.
    """
    end = time.monotonic() + LINGER
    for publisher in node.publishers:
        publisher.wait_for_all_acked(Duration(seconds=max(end - time.monotonic(), 0.0)))
