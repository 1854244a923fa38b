"""A lifecycle node that is led by its loop: transitions are the loop's, and may take their time.

rclpy carries a transition out in the thread that answers all requests, and answers nothing else for
as long as it takes. Here the loop takes the requests for transitions, at its wake-ups. So none
comes in the middle of a step, the thread that answers everything else goes on, and what takes long
goes into a thread of its own, while the loop waits for its end, a signal or another request.
"""

import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, wait
from queue import SimpleQueue
from typing import Any, NoReturn, TypeVar

from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.service import Service

from ab_msgs_py.services import CHANGE_STATE, answer_waiting
from ab_sim.errors import AbSimError, Interrupted
from ab_sim.nodes.log import PlainLog

GLANCE = 0.05
"""s between two looks at what is asked, where there is nothing else to do."""
PROGRESS = 5.0
"""s between two words on what takes long."""
Result = TypeVar("Result")
Say = Callable[[str], Any]


class Managed(PlainLog, LifecycleNode):
    """To be derived from: ``configure``, ``activate``, ``deactivate`` and ``cleanup`` do the work.

    An error of ab_sim refuses the transition and is told; any other one ends the node.

    Args:
        name: of the node.
        urgent: names of the services that the loop answers itself, besides those of transitions.
    """

    def __init__(self, name: str, *urgent: str) -> None:
        super().__init__(name)
        self.stopping = threading.Event()
        self._urgent = {self.resolve_service_name(own) for own in (CHANGE_STATE, *urgent)}
        self.by_loop = [s for s in super().services if s.service_name in self._urgent]
        """Whoever offers an urgent service adds it."""
        self._failure: Exception | None = None

    @property
    def services(self) -> Iterator[Service[Any, Any]]:
        """What the executor answers: all but what the loop answers itself."""
        return (s for s in super().services if s.service_name not in self._urgent)

    def destroy_node(self) -> None:
        """As any node's; its DDS participant leaves at once.

        rclpy leaves the state machine, which holds the node, to the search for garbage. That never
        comes where the process ends: others then see the node for the 20 s of the DDS lease.
        """
        super().destroy_node()
        self._state_machine.destroy_when_not_in_use()

    def configure(self) -> None:
        """Make ready what takes long."""
        raise NotImplementedError

    def activate(self) -> None:
        """Time goes on."""
        raise NotImplementedError

    def deactivate(self) -> None:
        """Time stands still."""
        raise NotImplementedError

    def cleanup(self) -> None:
        """Give back what was made ready."""
        raise NotImplementedError

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """For rclpy."""
        return self._done(self.configure)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """For rclpy."""
        return self._done(self.activate)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """For rclpy."""
        return self._done(self.deactivate)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """For rclpy."""
        return self._done(self.cleanup)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """For rclpy: the end, in order, as a signal would bring it."""
        self.stopping.set()
        return TransitionCallbackReturn.SUCCESS

    def start_up(self) -> None:
        """Configure and activate, without being asked.

        Raises:
            AbSimError: why it cannot be done; ``Interrupted``: told to end meanwhile.
        """
        for transition in (self.trigger_configure, self.trigger_activate):
            if transition() is not TransitionCallbackReturn.SUCCESS:
                self._raise()

    def answer(self) -> None:
        """Answer what only the loop answers, transitions among it.

        Raises:
            Exception: one that is none of ab_sim's, from a transition.
        """
        for service in self.by_loop:
            answer_waiting(service)
        if isinstance(self._failure, AbSimError):
            if not self.stopping.is_set():
                self.get_logger().error(str(self._failure))
            self._failure = None
        elif self._failure is not None:
            self._raise()

    def meanwhile(self, act: Callable[[Say], Result], doing: str) -> Result:
        """Do what takes long in a thread of its own, and answer requests until it is done.

        Args:
            act: is given what to tell people by; what it has to say is logged here, for ROS may be
                gone when it is left behind.
            doing: what that is, for the log.

        Raises:
            Interrupted: told to end; ``act`` is left behind.
            Exception: as ``act``.
        """
        said: SimpleQueue[str] = SimpleQueue()
        future = _in_a_thread(lambda: act(said.put))
        began = told = time.monotonic()
        while not wait([future], timeout=GLANCE).done:
            if self.stopping.is_set():
                raise Interrupted("interrupted")
            while not said.empty():
                self.get_logger().info(said.get())
            if (now := time.monotonic()) - told > PROGRESS:
                told = now
                self.get_logger().info(f"{doing}: {now - began:.0f} s so far")
            self.answer()
        return future.result()

    def unless_ended(self, act: Callable[[], Result]) -> Result:
        """Do what takes long for a callback, which is to be over soon when the node ends.

        A callback that goes on holds the node, and with it the node's place in others' graphs.

        Raises:
            Interrupted: told to end; ``act`` is left behind.
            Exception: as ``act``.
        """
        future = _in_a_thread(act)
        while not wait([future], timeout=GLANCE).done:
            if self.stopping.is_set():
                raise Interrupted("interrupted")
        return future.result()

    def _done(self, act: Callable[[], None]) -> TransitionCallbackReturn:
        """rclpy drops what is raised without a word: it is kept for the loop."""
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


def _in_a_thread(act: Callable[[], Result]) -> "Future[Result]":
    future: Future[Result] = Future()

    def work() -> None:
        try:
            future.set_result(act())
        except BaseException as error:
            future.set_exception(error)

    threading.Thread(target=work, name="aside", daemon=True).start()
    return future
