"""Process of a node: start, executor thread, and orderly exit on Ctrl-C and SIGTERM."""

import contextlib
import ctypes
import os
import re
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

import rclpy
from rclpy.action import ActionServer
from rclpy.duration import Duration
from rclpy.exceptions import ParameterException
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from ab_sim.base import interruption
from ab_sim.base.errors import AbSimError, InputError, shortened, visible
from ab_sim.nodes import discovery
from ab_sim.nodes.discovery import stuck_ports, unheard_users

_SECURITY = "ROS_SECURITY_ENABLE"
"""Environment variable that turns on ROS's security (SROS 2)."""
_MOST_DOMAIN = 232
"""Largest domain id whose UDP port numbers exist (DDSI-RTPS, 9.6.2)."""
_UNREADABLE = re.compile(r"params file: '--params-file (.+)'\. Error: (.+?)\s*, at /", re.DOTALL)
"""Pattern of the parameter file's name and the reason in rcl's error on a bad file."""


def init_ros(arguments: Sequence[str] | None = None) -> None:
    """Call ``rclpy.init`` with strict arguments and discovery on this machine only.

    ``ab_sim.base.interruption`` handles signals. rclpy's own handlers would shut down the context
    while messages are in flight.

    Parameters
    ----------
    arguments
        Program and arguments; default: those of the process.

    Raises
    ------
    InputError
        ROS would ignore an argument, or does not understand it; the domain is invalid, or ROS
        cannot write its log.
    """
    argument_list = sys.argv if arguments is None else arguments
    if stray := _outside_ros_args(argument_list[1:]):
        raise InputError(
            f"argument {stray[0]!r}: is unknown; parameters come after --ros-args, each after "
            f"-p: `--ros-args -p {_as_parameter(stray[0])}`"
        )
    _check_domain()
    _check_security()
    discovery.prepare()
    for warning in (discovery.unused_transports(), unheard_users(), stuck_ports()):
        if warning:
            print(visible(warning), file=sys.stderr)
    try:
        rclpy.init(args=list(argument_list), signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:
        # rclpy does not export its own exceptions.
        if "initialize logging" in str(error) or "for writing" in str(error):
            raise InputError(
                f"ROS cannot write its log: {error}; set ROS_LOG_DIR to a folder in which this "
                "user can write"
            ) from error
        if "SECURITY ERROR" in str(error):
            raise InputError(
                f"{_SECURITY} = 'true': {error}; set ROS_SECURITY_KEYSTORE to a keystore with an "
                f"enclave for this node, or unset {_SECURITY}"
            ) from error
        if unreadable := _UNREADABLE.search(str(error)):
            raise InputError(
                f"parameter file {unreadable[1]}: ROS cannot read it: {unreadable[2]}; it must be "
                "YAML of the form `NODE: {ros__parameters: {name: value}}`, without anchors"
            ) from error
        raise InputError(
            f"arguments {' '.join(argument_list[1:])}: ROS does not understand them: {error}; a "
            "parameter is given as `--ros-args -p name:=value`"
        ) from error


def _check_domain() -> None:
    """Refuse a domain id for which DDS has no ports; its own error does not name the variable."""
    domain = os.environ.get("ROS_DOMAIN_ID", "")
    if domain and not (domain.isdecimal() and int(domain) <= _MOST_DOMAIN):
        raise InputError(
            f"ROS_DOMAIN_ID = {domain!r}: must be a whole number from 0 to {_MOST_DOMAIN}; set "
            "another one, or unset it for 0"
        )


def _check_security() -> None:
    """Refuse to start with SROS 2 if the installed Fast DDS has no security plug-ins."""
    if os.environ.get(_SECURITY, "").lower() == "true" and discovery.from_pypi():
        raise InputError(
            f"{_SECURITY} = {os.environ[_SECURITY]!r}: the Fast DDS from PyPI has no security "
            "plug-ins (SROS 2); unset it, or use the ROS 2 of a distribution"
        )


def _outside_ros_args(arguments: Sequence[str]) -> list[str]:
    """Return the arguments that are not for ROS: before --ros-args, or after its final `--`."""
    # `remove_ros_args` would take `scene:=x` for a remapping in the old style, and remove it.
    outside, ours = [], True
    for argument in arguments:
        if argument == "--ros-args":
            ours = False
        elif argument == "--" and not ours:
            ours = True
        elif ours:
            outside.append(argument)
    return outside


def _as_parameter(stray: str) -> str:
    """Return a stray argument as a parameter, for a hint; a placeholder if it is none."""
    return stray.lstrip("-") if ":=" in stray else "name:=value"


_NOTICED = 0.2
"""Time from the node's end to the DDS participant's [s], so that peers notice. With a peer
that was repeatedly paused for up to 0.15 s, 0.1 s was too short in 2 of 80 exits."""

LONGEST = 5.0
"""Longest time for leaving the graph [s]; on a busy machine it takes 1 s."""


def leave_graph(node: Node, longest: float = LONGEST) -> bool:
    """Destroy the only node of a process, and its DDS participant.

    Parameters
    ----------
    node
        Node to destroy.
    longest
        Longest time to wait [s].

    Returns
    -------
    bool
        True if both were destroyed in time; see ``completes``.
    """
    return completes(lambda: _leave_graph(node), longest)


def completes(destroy: Callable[[], None], longest: float = LONGEST) -> bool:
    """Destroy ROS nodes in a separate thread, and return whether that ended within ``longest`` [s].

    Fast DDS 3.2 may deadlock if a peer leaves at the same time, as in 1 of 90 runs of
    ``ab-sim demo``: a thread that removes the peer's writer holds the lock of the participant's
    discovery and waits for a timer, whose thread waits for this lock.

    Parameters
    ----------
    destroy
        Function that destroys the nodes.
    longest
        Longest time to wait [s].

    Returns
    -------
    bool
        True if the nodes were destroyed. If not, ROS must not be called again, and only
        ``interruption.exit_process`` ends the process.
    """
    failures: list[BaseException] = []

    def leave() -> None:
        try:
            destroy()
        except BaseException as failure:
            failures.append(failure)

    leaving = threading.Thread(target=leave, name="leaving", daemon=True)
    leaving.start()
    leaving.join(longest)
    if failures:
        raise failures[0]
    return not leaving.is_alive()


def _leave_graph(node: Node) -> None:
    """Destroy the node, then the participant.

    Peers keep two lists in two threads: the participants, and the nodes that each participant has
    announced. If a peer processes the last announcement of a participant after the participant has
    left, it lists the nodes forever (``update_participant_entities`` of rmw_dds_common adds them
    again). This happened in 2 of 725 exits, and in 14 of 180 with a peer that was sometimes paused.
    Therefore the participant first announces that the node has gone. This requires another, hidden
    node, because the participant disappears together with its last node.
    """
    last = Node(
        f"_ab_sim_{os.getpid()}",
        context=node.context,
        use_global_arguments=False,
        enable_rosout=False,
        start_parameter_services=False,
    )
    with last.handle:  # destroyed at the end of this block, after everything that belongs to it
        for waitable in tuple(node.waitables):
            if isinstance(waitable, ActionServer):
                waitable.destroy()  # `destroy_node` does not, and the node would remain visible
        node.destroy_node()
        last.destroy_node()
        time.sleep(_NOTICED)


_LINGER = 0.5
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

    Parameters
    ----------
    make
        Function that creates the node. rclpy is initialised before its call, and must not have been
        initialised by the caller.
    loop
        Function that runs in the main thread until its event is set. It can then still publish its
        last messages.
    arguments
        Program and arguments; default: those of the process.
    """
    interruption.watch()
    sys.setswitchinterval(TURN)
    code, has_left = 0, True
    try:
        init_ros(arguments)
        # Before the DDS participant is created: if it did not leave in order, peers would see it
        # until its lease expires, 20 s later.
        with interruption.in_order() as stopping:
            node = _created(make)
            try:
                try:
                    with _answering(node, stopping):
                        loop(node, stopping)
                finally:  # also after an error, whose messages matter most
                    _wait_for_acknowledgements(node)
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


def _created(make: Callable[[], SomeNode]) -> SomeNode:
    """Create a node.

    Raises
    ------
    InputError
        A parameter that ROS defines, such as use_sim_time, has a value of another type.
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


def _wait_for_acknowledgements(node: Node) -> None:
    """Wait until subscribers have received the last messages, for at most ``_LINGER``.

    Acknowledgements may take a heartbeat period, which is 3 s if ``discovery`` could not shorten
    it. The samples themselves mostly arrive much earlier.
    """
    end = time.monotonic() + _LINGER
    for publisher in node.publishers:
        publisher.wait_for_all_acked(Duration(seconds=max(end - time.monotonic(), 0.0)))
