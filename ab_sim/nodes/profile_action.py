"""The action ``~/run``: one goal at a time runs a profile to its end, and hears of it meanwhile."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node

from ab_msgs_py import actions
from ab_msgs_py.actions import Asked, Outcome, Progress

FEEDBACK_PERIOD = 0.1
"""s between two feedbacks while nothing else happens."""
GOODBYE = 1.0
"""s for the last result to leave when the node ends, and"""
LINGER = 0.3
"""s for it to come where it is awaited."""

if TYPE_CHECKING:
    Goal = ServerGoalHandle[Any, Any, Any]
    _AnyActionServer = ActionServer[Any, Any, Any]
else:  # rclpy 7, of ROS 2 Jazzy, takes no subscripts at run time
    _AnyActionServer = ActionServer


class ProfileAction:
    """Serves the action; without its package built there is none, and the log says so.

    A goal that cannot be run is accepted and aborted at once: ROS's refusal of a goal carries no
    text, a result does. A goal whose client has vanished is run to its end.

    rclpy would have a goal executed by a coroutine, which waits by running again and again: its
    ``EventsExecutor`` then takes a whole core. So nothing of rclpy's runs while a goal counts as
    executing; its result is given when its profile is over.

    Args:
        node: offers it.
        start: starts what a goal asks for; why not, if it does not.
        cancel: ramps down; whether there was something to ramp down.
    """

    def __init__(
        self, node: Node, start: Callable[[Asked], str], cancel: Callable[[], bool]
    ) -> None:
        self._node, self._start, self._cancel = node, start, cancel
        self._goal: Goal | None = None
        self._told, self._said = -math.inf, ""
        self._left = threading.Event()
        if (kind := actions.run_profile()) is None:
            node.get_logger().info(actions.NOT_BUILT)
            return
        self._server = _Server(
            node,
            kind,
            actions.RUN,
            lambda goal: None,  # each goal has a callback of its own
            handle_accepted_callback=self._accepted,
            cancel_callback=self._asked_to_cancel,
        )

    def tell(self, progress: Callable[[], Progress], status: str) -> None:
        """Tell who has asked how far it has come, if it is time, or was not told of this status."""
        now = time.monotonic()
        anew = status != self._said
        if self._goal is not None and (anew or now - self._told >= FEEDBACK_PERIOD):
            self._told, self._said = now, status
            self._goal.publish_feedback(actions.feedback_of(progress()))

    def finish(self, well: bool, outcome: Callable[[], Outcome]) -> None:
        """The profile is over; nothing to do unless it was run for a goal."""
        goal, self._goal = self._goal, None
        if goal is not None:
            self._end(goal, well, outcome())
            if (executor := self._node.executor) is not None:
                executor.create_task(self._left.set)  # after the result has been sent

    def end(self, outcome: Callable[[], Outcome]) -> None:
        """The node ends: for the thread that does not answer callbacks."""
        if self._goal is not None:
            self._left.clear()
            self.finish(False, outcome)
            self._left.wait(GOODBYE)
            # No one says whether an answer has come, and it is lost with what has sent it.
            time.sleep(LINGER)

    def _accepted(self, goal: Goal) -> None:
        goal.execute()
        refusal = "another goal is being run; cancel it first" if self._goal is not None else ""
        if not refusal:
            self._goal, self._told = goal, -math.inf  # before it is started: it may be over at once
            if refusal := self._start(actions.asked_of(goal.request)):
                self._goal = None
        if refusal:
            self._end(goal, False, Outcome(f"refused: {refusal}", 0.0, 0.0))

    def _asked_to_cancel(self, goal: Goal) -> CancelResponse:
        asked = self._goal is not None and goal.goal_id == self._goal.goal_id
        return CancelResponse.ACCEPT if asked and self._cancel() else CancelResponse.REJECT

    def _end(self, goal: Goal, well: bool, outcome: Outcome) -> None:
        def result(goal: Goal) -> Any:
            if goal.is_cancel_requested:
                goal.canceled()
            elif well:
                goal.succeed()
            else:
                goal.abort()
            return actions.result_of(outcome)

        self._server.notify_execute(goal, result)


class _Server(_AnyActionServer):
    """rclpy's, for goals that are executing before there is a callback for their result."""

    def notify_execute(
        self, goal_handle: Goal, execute_callback: Callable[[Goal], Any] | None
    ) -> None:
        """As rclpy's, which ``Goal.execute`` calls; with no callback nothing is scheduled."""
        if execute_callback is not None:
            super().notify_execute(goal_handle, execute_callback)
