"""Command line of a node: arguments that ROS would silently ignore are errors."""

import sys
from collections.abc import Sequence

import rclpy
from rclpy.signals import SignalHandlerOptions

from ab_sim.errors import InputError
from ab_sim.nodes import discovery


def init_ros(arguments: Sequence[str] | None = None) -> None:
    """Call ``rclpy.init`` with strict arguments and discovery on this machine only.

    ``ab_sim.interruption`` handles signals. rclpy's own handlers would shut down the context while
    messages are in flight.

    Args:
        arguments: program and arguments; default: those of the process.

    Raises:
        InputError: ROS would ignore an argument, or does not understand it.
    """
    given = sys.argv if arguments is None else arguments
    if stray := _outside_ros_args(given[1:]):
        raise InputError(
            f"argument {stray[0]!r}: is not known; parameters come after --ros-args, each after "
            f"-p: `--ros-args -p {_as_parameter(stray[0])}`"
        )
    discovery.prepare()
    try:
        rclpy.init(args=list(given), signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:
        # rclpy does not export its own exceptions.
        raise InputError(
            f"arguments {' '.join(given[1:])}: ROS does not understand them: {error}; a parameter "
            "is given as `--ros-args -p name:=value`"
        ) from error


def _outside_ros_args(arguments: Sequence[str]) -> list[str]:
    # `remove_ros_args` would take `scene:=x` for a remapping in the old style, and remove it.
    outside, ours = [], True
    for argument in arguments:
        if argument == "--ros-args":
            ours = False
        elif argument == "--" and not ours:
            ours = True
        elif ours:
            outside.append(argument)
    return outside


def _as_parameter(stray: str) -> str:
    return stray.lstrip("-") if ":=" in stray else "name:=value"
