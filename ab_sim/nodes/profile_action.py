"""Action ``~/run`` of the profile controller: runs a profile to its end, with feedback."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable

from rclpy.action import CancelResponse
from rclpy.node import Node

from ab_msgs_py import actions
from ab_msgs_py.actions import Asked, Outcome, Progress
from ab_sim.nodes.goal_server import Goal, GoalServer

FEEDBACK_PERIOD = 0.1
"""Time between two feedback messages if the status does not change [s]."""
GOODBYE = 1.0
"""Longest time for the last result to be sent when the node exits [s]."""
LINGER = 0.3
"""Time for the last result to arrive at the client [s]."""


class ProfileAction:
    """Serves the action, one goal at a time; if its package is not built, logs this instead.

    A goal that cannot be run is accepted and immediately aborted, because in ROS the refusal of a
    goal has no text, but a result has. A goal whose client has exited is run to its end.

    Args:
        node: node that offers the action.
        start: function that starts the profile of a goal, and returns the reason if it cannot.
        cancel: function that ramps down, and returns whether a profile was running.
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
        self._server = GoalServer(node, kind, actions.RUN, self._accepted, self._asked_to_cancel)

    def tell(self, progress: Callable[[], Progress], status: str) -> None:
        """Send feedback to the goal's client if it is due, or if the status has changed."""
        now = time.monotonic()
        anew = status != self._said
        if self._goal is not None and (anew or now - self._told >= FEEDBACK_PERIOD):
            self._told, self._said = now, status
            self._goal.publish_feedback(actions.feedback_of(progress()))

    def finish(self, well: bool, outcome: Callable[[], Outcome]) -> None:
        """Set the result of the present goal, if there is one; ``well``: it has succeeded."""
        goal, self._goal = self._goal, None
        if goal is not None:
            self._end(goal, well, outcome())
            if (executor := self._node.executor) is not None:
                executor.create_task(self._left.set)  # after the result has been sent

    def end(self, outcome: Callable[[], Outcome]) -> None:
        """End the present goal when the node exits; call it in another thread than callbacks."""
        if self._goal is not None:
            self._left.clear()
            self.finish(False, outcome)
            self._left.wait(GOODBYE)
            # An answer is not acknowledged, and is lost if its sender exits too soon.
            time.sleep(LINGER)

    def _accepted(self, goal: Goal) -> None:
        goal.execute()
        refusal = "another goal is being run; cancel it first" if self._goal is not None else ""
        if not refusal:
            # Set before the start, because the profile may end immediately.
            self._goal, self._told = goal, -math.inf
            if refusal := self._start(actions.asked_of(goal.request)):
                self._goal = None
        if refusal:
            self._end(goal, False, Outcome(f"refused: {refusal}", 0.0, 0.0))

    def _asked_to_cancel(self, goal: Goal) -> CancelResponse:
        asked = self._goal is not None and goal.goal_id == self._goal.goal_id
        return CancelResponse.ACCEPT if asked and self._cancel() else CancelResponse.REJECT

    def _end(self, goal: Goal, well: bool, outcome: Outcome) -> None:
        self._server.end(goal, well, actions.result_of(outcome))
