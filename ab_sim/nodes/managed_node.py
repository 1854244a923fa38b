"""Lifecycle node whose main loop performs the transitions.

rclpy performs a transition in the executor's thread, and serves no other callback meanwhile. Here
the main loop reads the requests for transitions at its wake-ups. So no transition happens during a
step, and the executor's thread continues. Long work runs in a separate thread, while the loop
serves requests and watches for a signal.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, wait
from queue import SimpleQueue
from typing import Any, NoReturn, TypeVar

from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.service import Service

from ab_msgs_py.services import CHANGE_STATE, answer_waiting
from ab_sim.base.errors import AbSimError, Interrupted
from ab_sim.nodes.base_node import BaseNode

GLANCE = 0.05
"""Time between two checks for requests when the loop is idle [s]."""
PROGRESS = 5.0
"""Time between two log messages on the progress of long work [s]."""
Result = TypeVar("Result")
Say = Callable[[str], Any]


class ManagedNode(BaseNode, LifecycleNode):
    """Base class; subclasses implement ``configure``, ``activate``, ``deactivate`` and ``cleanup``.

    An AbSimError refuses the transition and is logged; any other exception ends the node.

    Args:
        name: name of the node.
        urgent: names of further services that the main loop serves, and not the executor.
    """

    def __init__(self, name: str, *urgent: str) -> None:
        super().__init__(name)
        self.stopping = threading.Event()
        self._urgent = {self.resolve_service_name(name) for name in (CHANGE_STATE, *urgent)}
        self.by_loop = [s for s in super().services if s.service_name in self._urgent]
        """Services that the main loop serves; the creator of an urgent service appends it."""
        self._failure: Exception | None = None

    @property
    def services(self) -> Iterator[Service[Any, Any]]:
        """Services that the executor serves: all but those of the main loop."""
        return (s for s in super().services if s.service_name not in self._urgent)

    def destroy_node(self) -> None:
        """Destroy the node and its state machine.

        rclpy leaves the state machine, which refers to the node, to the garbage collector. At the
        end of a process, this may never run. Peers would then see the node until the DDS lease of
        20 s ends.
        """
        super().destroy_node()
        self._state_machine.destroy_when_not_in_use()

    def configure(self) -> None:
        """Perform the transition configure: load and prepare, which may take long."""
        raise NotImplementedError

    def activate(self) -> None:
        """Perform the transition activate: start simulated time."""
        raise NotImplementedError

    def deactivate(self) -> None:
        """Perform the transition deactivate: stop simulated time."""
        raise NotImplementedError

    def cleanup(self) -> None:
        """Perform the transition cleanup: release all resources."""
        raise NotImplementedError

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Configure; called by rclpy."""
        return self._done(self.configure)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Activate; called by rclpy."""
        return self._done(self.activate)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Deactivate; called by rclpy."""
        return self._done(self.deactivate)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Clean up; called by rclpy."""
        return self._done(self.cleanup)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Request an orderly exit, as after a signal; called by rclpy."""
        self.stopping.set()
        return TransitionCallbackReturn.SUCCESS

    def start_up(self) -> None:
        """Configure and activate without a request.

        Raises:
            AbSimError: a transition failed; ``Interrupted``: the node is to exit.
        """
        for transition in (self.trigger_configure, self.trigger_activate):
            if transition() is not TransitionCallbackReturn.SUCCESS:
                self._raise()

    def answer(self) -> None:
        """Serve the services of the main loop, transitions included.

        Raises:
            Exception: a transition raised an error that is not an AbSimError.
        """
        for service in self.by_loop:
            answer_waiting(service)
        if isinstance(self._failure, AbSimError):
            if not self.stopping.is_set():
                self.get_logger().error(str(self._failure))
            self._failure = None
        elif self._failure is not None:
            self._raise()

    def run_in_thread(self, act: Callable[[Say], Result], doing: str) -> Result:
        """Run long work in a separate thread, and serve requests until it is done.

        Args:
            act: function that does the work. Its argument is a function that queues a text for the
                log; the main loop logs it, because ROS may be shut down before ``act`` returns.
            doing: name of the work, for the log.

        Raises:
            Interrupted: the node is to exit; ``act`` is abandoned.
            Exception: any exception of ``act``.
        """
        messages: SimpleQueue[str] = SimpleQueue()
        future = _in_a_thread(lambda: act(messages.put))
        began = logged = time.monotonic()
        while not wait([future], timeout=GLANCE).done:
            if self.stopping.is_set():
                raise Interrupted("interrupted")
            while not messages.empty():
                self.get_logger().info(messages.get())
            if (now := time.monotonic()) - logged > PROGRESS:
                logged = now
                self.get_logger().info(f"{doing}: {now - began:.0f} s so far")
            self.answer()
        return future.result()

    def run_unless_shut_down(self, act: Callable[[], Result]) -> Result:
        """Run long work of a callback in a separate thread, and wait for its end.

        A callback that does not return would keep the node from exiting and from leaving the graph.

        Raises:
            Interrupted: the node is to exit; ``act`` is abandoned.
            Exception: any exception of ``act``.
        """
        future = _in_a_thread(act)
        while not wait([future], timeout=GLANCE).done:
            if self.stopping.is_set():
                raise Interrupted("interrupted")
        return future.result()

    def _done(self, act: Callable[[], None]) -> TransitionCallbackReturn:
        """Perform a transition, and keep its exception for the main loop: rclpy would drop it."""
        try:
            act()
        except Exception as error:
            self._failure = error
            refused = isinstance(error, AbSimError)
            return TransitionCallbackReturn.FAILURE if refused else TransitionCallbackReturn.ERROR
        return TransitionCallbackReturn.SUCCESS

    def _raise(self) -> NoReturn:
        assert self._failure is not None
        raise self._failure


def _in_a_thread(act: Callable[[], Result]) -> Future[Result]:
    future: Future[Result] = Future()

    def work() -> None:
        try:
            future.set_result(act())
        except BaseException as error:
            future.set_exception(error)

    threading.Thread(target=work, name="aside", daemon=True).start()
    return future
