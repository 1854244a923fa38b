"""A lifecycle node whose main loop carries out the transitions.

rclpy carries out a transition in the executor's thread, and serves no other callback meanwhile.
Here the main loop reads the requests for transitions at its wake-ups. So no transition happens
during a step, and the executor's thread continues. Long work runs in a separate thread while the
loop waits for its end, a signal or another request.
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
"""Time between two log messages on long work [s]."""
Result = TypeVar("Result")
Say = Callable[[str], Any]


class ManagedNode(BaseNode, LifecycleNode):
    """Base class; subclasses implement ``configure``, ``activate``, ``deactivate`` and ``cleanup``.

    An AbSimError refuses the transition and is logged; any other exception ends the node.

    Args:
        name: name of the node.
        urgent: names of further services that the main loop serves itself.
    """

    def __init__(self, name: str, *urgent: str) -> None:
        super().__init__(name)
        self.stopping = threading.Event()
        self._urgent = {self.resolve_service_name(name) for name in (CHANGE_STATE, *urgent)}
        self.by_loop = [s for s in super().services if s.service_name in self._urgent]
        """Services served by the main loop; urgent ones are appended by their owners."""
        self._failure: Exception | None = None

    @property
    def services(self) -> Iterator[Service[Any, Any]]:
        """Services that the executor serves: all but those of the main loop."""
        return (s for s in super().services if s.service_name not in self._urgent)

    def destroy_node(self) -> None:
        """Destroy the node and its state machine at once.

        rclpy leaves the state machine, which holds the node, to the garbage collector. At the end
        of a process that may never run: others would see the node for the DDS lease of 20 s.
        """
        super().destroy_node()
        self._state_machine.destroy_when_not_in_use()

    def configure(self) -> None:
        """Prepare long work for the transition configure."""
        raise NotImplementedError

    def activate(self) -> None:
        """Start time for the transition activate."""
        raise NotImplementedError

    def deactivate(self) -> None:
        """Stop time for the transition deactivate."""
        raise NotImplementedError

    def cleanup(self) -> None:
        """Release resources for the transition cleanup."""
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
            AbSimError: a transition failed; ``Interrupted``: the node was asked to exit.
        """
        for transition in (self.trigger_configure, self.trigger_activate):
            if transition() is not TransitionCallbackReturn.SUCCESS:
                self._raise()

    def answer(self) -> None:
        """Serve the services of the main loop, transitions included.

        Raises:
            Exception: a transition raised another error than AbSimError.
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
            act: called with a function that queues a text for the log. The texts are logged here,
                because ROS may be shut down before ``act`` returns.
            doing: name of the work, for the log.

        Raises:
            Interrupted: the node was asked to end; ``act`` is abandoned.
            Exception: as ``act``.
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
        """Run long work of a callback; return early when the node is asked to end.

        A callback that does not return would keep the node alive, also in the graphs of others.

        Raises:
            Interrupted: the node was asked to end; ``act`` is abandoned.
            Exception: as ``act``.
        """
        future = _in_a_thread(act)
        while not wait([future], timeout=GLANCE).done:
            if self.stopping.is_set():
                raise Interrupted("interrupted")
        return future.result()

    def _done(self, act: Callable[[], None]) -> TransitionCallbackReturn:
        """Run a transition; keep its exception, which rclpy would drop, for the main loop."""
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
