"""Action SimulateSteps of ROS's simulation_interfaces: simulates wake-ups of a paused drive."""

from __future__ import annotations

from typing import Any

from rclpy.action import CancelResponse

from ab_sim.base.errors import AbSimError
from ab_sim.nodes.drive_control import DriveControl
from ab_sim.nodes.drive_node import DriveNode
from ab_sim.nodes.goal_server import Goal, GoalServer


class SimulateSteps:
    """Serves the action, one goal at a time.

    Each wake-up is a separate task of the node's executor. Between two tasks, the executor answers
    other requests, such as one to cancel.

    Args:
        node: node of the drive.
        kind: type of the action.
        codes: message type with the result codes of the standard.
        control: services of the drive, which simulate the wake-ups.
    """

    def __init__(self, node: DriveNode, kind: Any, codes: Any, control: DriveControl) -> None:
        self._node, self._kind, self._codes, self._control = node, kind, codes, control
        self._goal: Goal | None = None
        self._server = GoalServer(
            node, kind, "~/simulate_steps", self._accepted, lambda goal: CancelResponse.ACCEPT
        )

    def _accepted(self, goal: Goal) -> None:
        goal.execute()
        if self._goal is not None:
            self._end(goal, "another goal is being executed; cancel it first")
            return
        self._goal = goal
        self._continue(0)

    def _continue(self, completed: int) -> None:
        """Simulate the next wake-up of the goal; ``completed``: number of those before."""
        goal = self._goal
        assert goal is not None and self._node.executor is not None
        problem, steps = "", goal.request.steps
        if self._node.stopping.is_set():
            problem = f"the node exits after {completed} steps"
        elif goal.is_cancel_requested:
            problem = f"canceled after {completed} steps"
        elif completed < steps:
            try:
                well, text = self._control.step(1)
                problem = "" if well else text
            except AbSimError as error:
                problem = str(error)
            if not problem:
                completed += 1
                goal.publish_feedback(
                    self._kind.Feedback(
                        completed_steps=completed, remaining_steps=steps - completed
                    )
                )
        if problem or completed >= steps:
            self._goal = None
            self._end(goal, problem)
        else:
            self._node.executor.create_task(self._continue, completed)

    def _end(self, goal: Goal, problem: str) -> None:
        result, codes = self._kind.Result(), self._codes
        result.result.result = codes.RESULT_OPERATION_FAILED if problem else codes.RESULT_OK
        result.result.error_message = problem
        self._server.end(goal, not problem, result)
