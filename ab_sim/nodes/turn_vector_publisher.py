"""Publisher of the once-per-turn vibration, as a balancing machine measures it."""

from collections.abc import Sequence

import numpy as np
from rclpy.node import Node

from ab_msgs_py import WhirlSample, topics
from ab_msgs_py.prefilled import Prefilled
from ab_msgs_py.samples import frame_of
from ab_sim.drive.trajectory import Trajectory
from ab_sim.drive.turn_vector import TurnVector
from ab_sim.scene import Scene
from ab_sim.scene.sensors import SPINDLE


class TurnVectorPublisher:
    """Publishes the once-per-turn vector over the last turn, if there are subscribers.

    Args:
        node: publishing node; its namespace is part of the frame's name.
    """

    def __init__(self, node: Node) -> None:
        self._publisher = topics.ONCE_PER_TURN.publisher(node)
        frame = frame_of(node.get_namespace(), SPINDLE)
        self._message = Prefilled(
            topics.ONCE_PER_TURN.message(WhirlSample(0, (0.0, 0.0, 0.0), frame))
        )
        self._turn: TurnVector | None = None

    def begin(self, scene: Scene) -> None:
        """Restart at the next sample, because it belongs to another run."""
        self._turn, self._step_ns = None, round(scene.solver.step * 1e9)

    def publish(self, runs: Sequence[Trajectory]) -> None:
        """Publish the vector at the last sample, if there is a whole turn before it.

        Args:
            runs: samples of all integration steps since the last call.
        """
        if not self._publisher.get_subscription_count():
            self._turn = None
            return
        if self._turn is None:
            self._turn = TurnVector()
        vector = complex(np.nan)
        for run in runs:
            if len(run):
                vector = self._turn.of(run["angle"], run["x"], run["y"])[-1]
                time = round(run["step"][-1]) * self._step_ns
        if np.isfinite(vector):
            place = float(vector.real), float(vector.imag), 0.0
            self._publisher.publish(self._message.at(time, place))
