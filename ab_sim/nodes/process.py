"""Process of a node: start, executor thread, orderly exit on Ctrl-C and SIGTERM."""

import contextlib
import ctypes
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

import rclpy
from rclpy.duration import Duration
from rclpy.exceptions import ParameterException
from rclpy.experimental import EventsExecutor
from rclpy.node import Node

from ab_sim.base import interruption
from ab_sim.base.errors import AbSimError, InputError, shortened, visible
from ab_sim.nodes.arguments import init_ros
from ab_sim.nodes.leaving import leave_graph

LINGER = 0.5
"""Longest time for subscribers to receive the last messages [s]."""
ENOUGH = 0.5
"""Longest time for a running callback to return when the node exits [s]."""
TURN = 0.5e-3
"""Time for which a thread may keep Python's lock while another one waits [s]. Python's default of 5
ms is longer than a wake-up period, so that a flood of requests would delay the main loop."""
_ARENA_MAX = -8
"""M_ARENA_MAX of glibc's malloc.h."""
SomeNode = TypeVar("SomeNode", bound=Node)


@interruption.left_at_exit()
def run_node(
    make: Callable[[], SomeNode],
    loop: Callable[[SomeNode, threading.Event], None],
    arguments: Sequence[str] | None = None,
) -> None:
    """Create a node, serve its callbacks in a thread, run ``loop``, and exit the process.

    An AbSimError is printed as one message, and exits with its code. While Python imports, Ctrl-C
    and SIGTERM exit immediately, with code 128 + the signal's number. Later they exit in order with
    0, and a second signal (after ``interruption.ONE_WISH``) exits immediately.

    Args:
        make: function that creates the node. rclpy is initialised before its call, and must not
            have been initialised by the caller.
        loop: function that runs in the main thread until its event is set. It can then still
            publish its last messages.
        arguments: program and arguments; default: those of the process.
    """
    interruption.watch()
    sys.setswitchinterval(TURN)
    code, has_left = 0, True
    try:
        init_ros(arguments)
        # Before the DDS participant is created: if it did not leave in order, peers would see it
        # until its lease expires, 20 s later.
        with interruption.in_order() as stopping:
            node = _made(make)
            try:
                try:
                    with _answering(node, stopping):
                        loop(node, stopping)
                finally:  # also after an error, whose messages matter most
                    _let_last_words_out(node)
            finally:
                has_left = leave_graph(node)
                if not has_left:
                    interruption.leave_at_exit()
    except AbSimError as error:
        print(visible(str(error)), file=sys.stderr)
        code = error.exit_code
    finally:
        if has_left:
            rclpy.try_shutdown()
    interruption.exit_process(code)


def _made(make: Callable[[], SomeNode]) -> SomeNode:
    """Create a node.

    Raises:
        InputError: a parameter that ROS defines, such as use_sim_time, has a value of another type.
    """
    try:
        return make()
    except ParameterException as error:
        raise InputError(f"a parameter has a wrong value: {shortened(str(error))}") from error


def share_heaps() -> None:
    """Limit glibc's malloc to one heap for all threads.

    By default, glibc creates up to eight heaps per core over time. Memory freed in one heap is not
    reused by others, so that memory use grows for hours. With one heap, threads may wait for each
    other, so this is not for real-time loops.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(_ARENA_MAX, 1)


@contextlib.contextmanager
def _answering(node: Node, stopping: threading.Event) -> Iterator[None]:
    """Serve the node's callbacks in a thread; an exception in one of them ends the process."""
    executor = EventsExecutor()
    executor.add_node(node)
    failures: list[BaseException] = []
    done = threading.Event()

    def spin() -> None:
        try:
            # Without a finite time-out, this executor cannot be stopped.
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
        # A callback that is still running, e.g. compiling a scene, uses the executor: it ends with
        # the process.
        if not thread.is_alive():
            executor.shutdown()
    if failures:
        raise failures[0]


def _let_last_words_out(node: Node) -> None:
    """Wait until subscribers have received the last messages, for at most ``LINGER``.

    Acknowledgements may take a heartbeat period, which is 3 s if ``discovery`` could not shorten
    it. The samples themselves mostly arrive much earlier.
    """
    end = time.monotonic() + LINGER
    for publisher in node.publishers:
        publisher.wait_for_all_acked(Duration(seconds=max(end - time.monotonic(), 0.0)))
