"""Base classes of nodes and action servers, and the publisher of a node's diagnostics."""

from __future__ import annotations

import functools
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, wait
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.node import Node
from rclpy.service import Service

from ab_msgs_py import Health, Level, Task, topics
from ab_msgs_py.services import CHANGE_STATE, Answer, answer_waiting, serve_switch, serve_trigger
from ab_sim.base.errors import AbSimError, Interrupted, visible

PARAMETERS = "parameters"
"""Key in diagnostics, and first word of the log entry, for a node's changed parameters."""


class BaseNode(Node):
    """Node whose log has no control characters, and whose services turn an AbSimError to a refusal.

    As a base class, it must come before ``LifecycleNode``.
    """

    parameter_defaults: Mapping[str, Any] = {
        "use_sim_time": False,
        "start_type_description_service": True,
    }
    """Defaults of the declared parameters, by name, which ROS does not store; at first those of the
    parameters that ROS declares for every node."""

    def parameter_values(self) -> dict[str, Any]:
        """Return the values of the declared parameters, without the QoS of topics."""
        declared = self.get_parameters_by_prefix("")
        return {name: declared[name].value for name in declared if "." not in name}

    def changed_parameters(self) -> str:
        """Return a text with names and values of the parameters that differ from the defaults."""
        defaults = self.parameter_defaults
        changed = [
            f"{name} = {value!r}"
            for name, value in sorted(self.parameter_values().items())
            if name not in defaults or value != defaults[name]
        ]
        return f"{', '.join(changed)}; others have their defaults" if changed else "all defaults"

    def get_logger(self) -> RcutilsLogger:
        """Return the node's logger, which makes control characters in messages visible."""
        return _Logger(super().get_logger().name)

    def offer(self, service: str, work: Callable[[], Answer]) -> Service[Any, Any]:
        """Advertise a Trigger service.

        Parameters
        ----------
        service
            Name of the service.
        work
            Function that does the work, and returns success and message. If it raises an
            AbSimError, the service refuses with its message.
        """
        return serve_trigger(self, service, _answered(work))

    def offer_switch(self, service: str, work: Callable[[bool], Answer]) -> None:
        """Advertise a SetBool service; ``work`` gets its value, otherwise as in ``offer``."""
        serve_switch(self, service, _answered(work))


def _answered(work: Callable[..., Answer]) -> Callable[..., Answer]:
    """Return ``work`` such that an AbSimError becomes a refusal and does not end the node."""

    @functools.wraps(work)
    def answer(*values: bool) -> Answer:
        try:
            return work(*values)
        except AbSimError as error:
            return False, str(error)

    return answer


class _Logger(RcutilsLogger):
    """Logger with one call per severity: rclpy allows each calling line one severity only."""

    def info(self, message: str, **filters: Any) -> bool:
        return super().info(visible(message), **filters)

    def warning(self, message: str, **filters: Any) -> bool:
        return super().warning(visible(message), **filters)

    def error(self, message: str, **filters: Any) -> bool:
        return super().error(visible(message), **filters)


GLANCE = 0.05
"""Time between two checks for requests when the loop is idle [s]."""
_PROGRESS = 5.0
"""Time between two log messages on the progress of long work [s]."""
Result = TypeVar("Result")
Say = Callable[[str], Any]


class ManagedNode(BaseNode, LifecycleNode):
    """Lifecycle node whose main loop, not the executor, serves the transitions.

    Subclasses implement ``configure``, ``activate``, ``deactivate`` and ``cleanup``. The main loop
    serves transitions because they may take long, and because they change what the loop uses.

    An AbSimError refuses the transition and is logged; any other exception ends the node.

    Parameters
    ----------
    name
        Name of the node.
    urgent
        Names of further services that the main loop serves, and not the executor.
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
        """Destroy the node and the lifecycle state machine.

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

        Raises
        ------
        AbSimError
            A transition failed; ``Interrupted``: the node is to exit.
        """
        for transition in (self.trigger_configure, self.trigger_activate):
            if transition() is not TransitionCallbackReturn.SUCCESS:
                self._raise()

    def answer(self) -> None:
        """Serve the services of the main loop, transitions included.

        Raises
        ------
        Exception
            A transition raised an error that is not an AbSimError.
        """
        for service in self.by_loop:
            answer_waiting(service)
        if isinstance(self._failure, AbSimError):
            if not self.stopping.is_set():
                self.get_logger().error(str(self._failure))
            self._failure = None
        elif self._failure is not None:
            self._raise()

    def run_in_thread(self, work: Callable[[Say], Result], doing: str) -> Result:
        """Run long work in a separate thread, and serve the node's requests until the work is done.

        Parameters
        ----------
        work
            Function that does the work. Its argument is a function that queues a text for the log;
            the main loop logs it, because ROS may be shut down before ``work`` returns.
        doing
            Name of the work, for the log.

        Raises
        ------
        Interrupted
            The node is to exit; ``work`` is abandoned.
        Exception
            Any exception of ``work``.
        """
        messages: SimpleQueue[str] = SimpleQueue()
        future = _in_a_thread(lambda: work(messages.put))
        began = logged = time.monotonic()
        while not wait([future], timeout=GLANCE).done:
            if self.stopping.is_set():
                raise Interrupted("interrupted")
            while not messages.empty():
                self.get_logger().info(messages.get())
            if (now := time.monotonic()) - logged > _PROGRESS:
                logged = now
                self.get_logger().info(f"{doing}: {now - began:.0f} s so far")
            self.answer()
        return future.result()

    def run_unless_shut_down(self, work: Callable[[], Result]) -> Result:
        """Run a callback's long work in a separate thread; wait until the end or a shut-down.

        A callback that does not return would keep the node from exiting and from leaving the graph.

        Raises
        ------
        Interrupted
            The node is to exit; ``work`` is abandoned.
        Exception
            Any exception of ``work``.
        """
        future = _in_a_thread(work)
        while not wait([future], timeout=GLANCE).done:
            if self.stopping.is_set():
                raise Interrupted("interrupted")
        return future.result()

    def _done(self, work: Callable[[], None]) -> TransitionCallbackReturn:
        """Perform a lifecycle transition, and return success or failure for rclpy.

        An exception is kept for the main loop (``answer``), because rclpy would drop it.
        """
        try:
            work()
        except Exception as error:
            self._failure = error
            refused = isinstance(error, AbSimError)
            return TransitionCallbackReturn.FAILURE if refused else TransitionCallbackReturn.ERROR
        return TransitionCallbackReturn.SUCCESS

    def _raise(self) -> NoReturn:
        """Raise the exception of the last transition."""
        assert self._failure is not None
        raise self._failure


def _in_a_thread(work: Callable[[], Result]) -> Future[Result]:
    """Call a function in a new thread, and return a future with the function's result.

    The thread is a daemon: unlike those of a ThreadPoolExecutor, it does not delay the exit.
    """
    future: Future[Result] = Future()

    def run() -> None:
        try:
            future.set_result(work())
        except BaseException as error:
            future.set_exception(error)

    threading.Thread(target=run, name="aside", daemon=True).start()
    return future


if TYPE_CHECKING:
    Goal = ServerGoalHandle[Any, Any, Any]
    _AnyActionServer = ActionServer[Any, Any, Any]
else:  # rclpy 7 of ROS 2 Jazzy does not support subscripts at run time
    Goal, _AnyActionServer = ServerGoalHandle, ActionServer


class GoalServer(_AnyActionServer):
    """Action server whose goals execute without a callback of rclpy.

    rclpy executes a goal by a coroutine that polls, with which its ``EventsExecutor`` uses a whole
    core. Here, no code of rclpy runs while a goal is executing, and ``end`` sets its result.

    Parameters
    ----------
    node
        Node that offers the action.
    kind
        Type of the action.
    name
        Name of the action.
    accepted
        Function that is called with each goal, and calls ``goal.execute()``.
    cancel
        Function that is called with a goal that its client wants to cancel.
    """

    def __init__(
        self,
        node: Node,
        kind: Any,
        name: str,
        accepted: Callable[[Goal], None],
        cancel: Callable[[Goal], CancelResponse],
    ) -> None:
        super().__init__(
            node,
            kind,
            name,
            lambda goal: None,  # not used: `end` schedules a callback for each goal
            handle_accepted_callback=accepted,
            cancel_callback=cancel,
        )

    def notify_execute(
        self, goal_handle: Goal, execute_callback: Callable[[Goal], Any] | None
    ) -> None:
        """Schedule the callback as rclpy does; without a callback, do nothing.

        ``Goal.execute`` calls this method.
        """
        if execute_callback is not None:
            super().notify_execute(goal_handle, execute_callback)

    def end(self, goal: Goal, well: bool, result: Any) -> None:
        """End a goal with a result message: canceled if requested, else succeeded or aborted.

        Parameters
        ----------
        goal
            Executing goal.
        well
            Whether the goal has succeeded.
        result
            Result message.
        """

        def executed(goal: Goal) -> Any:
            if goal.is_cancel_requested:
                goal.canceled()
            elif well:
                goal.succeed()
            else:
                goal.abort()
            return result

        self.notify_execute(goal, executed)


class DiagnosticsPublisher:
    """Publishes a node's diagnostics, and logs each change of their level.

    Parameters
    ----------
    node
        Publishing node.
    task
        Task of the node, which is part of the entry's name.
    """

    def __init__(self, node: BaseNode, task: Task) -> None:
        self._node, self._task = node, task
        self._topic = topics.DIAGNOSTICS.publisher(node)
        self._level = Level.OK
        self.hardware = "ab_sim"
        """``hardware_id`` of the entry."""

    def publish(
        self,
        level: Level,
        text: str,
        values: Mapping[str, str] | None = None,
        time_ns: int = 0,
        logged: bool = False,
    ) -> bool:
        """Publish the present state and the node's parameters.

        Parameters
        ----------
        level
            Level of the state.
        text
            Description of the state.
        values
            Values by name, with units in the names.
        time_ns
            Simulated time [ns].
        logged
            Whether the text has already been logged.

        Returns
        -------
        bool
            True if the text has been logged, now or before.
        """
        name = self._node.get_fully_qualified_name()
        entries = {**(values or {}), PARAMETERS: self._node.changed_parameters()}
        health = Health(name, self._task, level, text, entries, self.hardware, time_ns)
        self._topic.publish(topics.DIAGNOSTICS.message(health))
        before, self._level = self._level, level
        if level is not before and not logged:
            self._log(level, text)
        return logged or level is not before

    def _log(self, level: Level, text: str) -> None:
        logger = self._node.get_logger()
        if level is Level.ERROR:
            logger.error(text)
        elif level is Level.WARN:
            logger.warning(text)
        else:
            logger.info(f"no more warnings: {text}")
