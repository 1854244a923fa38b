"""Action server that executes goals without rclpy's coroutines."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node

if TYPE_CHECKING:
    Goal = ServerGoalHandle[Any, Any, Any]
    _AnyActionServer = ActionServer[Any, Any, Any]
else:  # rclpy 7 of ROS 2 Jazzy does not support subscripts at run time
    Goal, _AnyActionServer = ServerGoalHandle, ActionServer


class GoalServer(_AnyActionServer):
    """Action server whose goals execute without a callback of rclpy.

    rclpy executes a goal by a coroutine that polls, with which its ``EventsExecutor`` uses a whole
    core. Here, no code of rclpy runs while a goal is executing, and ``end`` sets its result.

    Args:
        node: node that offers the action.
        kind: type of the action.
        name: name of the action.
        accepted: function that is called with each goal, and calls ``goal.execute()``.
        cancel: function that is called with a goal that its client wants to cancel.
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

        Args:
            goal: executing goal.
            well: whether the goal has succeeded.
            result: result message.
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
