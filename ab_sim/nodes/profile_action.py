"""The action ``~/run``: one goal at a time runs a profile to its end, and hears of it meanwhile."""

import math
import threading
import time
from collections.abc import Callable
from typing import Any

from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node
from rclpy.task import Future

from ab_msgs_py import actions
from ab_msgs_py.actions import Asked, Outcome, Progress

FEEDBACK_PERIOD = 0.1
"""s between two feedbacks while nothing else happens."""
GOODBYE = 0.5
"""s for the last result to leave when the node ends."""


class ProfileAction:
    """Serves the action; without its package built there is none, and the log says so.

    A goal that cannot be run is accepted and aborted at once: ROS's refusal of a goal carries no
    text, a result does. A goal whose client has vanished is run to its end.

    Args:
        node: offers it.
        start: starts what a goal asks for; why not, if it does not.
        cancel: ramps down; whether there was something to ramp down.
    """

    def __init__(
        self, node: Node, start: Callable[[Asked], str], cancel: Callable[[], bool]
    ) -> None:
        self._start, self._cancel = start, cancel
        self._over: Future[tuple[bool, Outcome]] | None = None
        self._goal: ServerGoalHandle[Any, Any, Any] | None = None
        self._told = -math.inf
        self._left = threading.Event()
        self._left.set()
        if (kind := actions.run_profile()) is None:
            node.get_logger().info(actions.NOT_BUILT)
            return
        self._server: ActionServer[Any, Any, Any] = ActionServer(
            node, kind, actions.RUN, self._execute, cancel_callback=self._asked_to_cancel
        )

    def tell(self, progress: Callable[[], Progress], anew: bool) -> None:
        """Tell who has asked how far it has come, if it is time, or something has changed."""
        now = time.monotonic()
        if self._goal is not None and (anew or now - self._told >= FEEDBACK_PERIOD):
            self._told = now
            self._goal.publish_feedback(actions.feedback_of(progress()))

    def finish(self, well: bool, outcome: Callable[[], Outcome]) -> None:
        """The profile is over; nothing to do unless it was run for a goal."""
        if self._over is not None and not self._over.done():
            self._over.set_result((well, outcome()))

    def end(self) -> None:
        """Let the last result leave: for the thread that does not answer callbacks."""
        self._left.wait(GOODBYE)

    async def _execute(self, goal: ServerGoalHandle[Any, Any, Any]) -> Any:
        if refusal := self._start_for(goal):
            goal.abort()
            return actions.result_of(Outcome(f"refused: {refusal}", 0.0, 0.0))
        assert self._over is not None
        how = await self._over
        assert how is not None
        well, outcome = how
        self._over = self._goal = None
        self._left.set()
        if goal.is_cancel_requested:
            goal.canceled()
        elif well:
            goal.succeed()
        else:
            goal.abort()
        return actions.result_of(outcome)

    def _start_for(self, goal: ServerGoalHandle[Any, Any, Any]) -> str:
        if self._goal is not None:
            return "another goal is being run; cancel it first"
        # Before it is started: it may be over at once.
        self._goal, self._over = goal, Future()
        self._told = -math.inf
        self._left.clear()
        if refusal := self._start(actions.asked_of(goal.request)):
            self._goal = self._over = None
            self._left.set()
        return refusal

    def _asked_to_cancel(self, goal: ServerGoalHandle[Any, Any, Any]) -> CancelResponse:
        return CancelResponse.ACCEPT if self._cancel() else CancelResponse.REJECT
