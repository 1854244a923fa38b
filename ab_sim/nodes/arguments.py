"""A node's command line: what ROS would pass over without a word is an error."""

import sys
from collections.abc import Sequence

import rclpy
from rclpy.signals import SignalHandlerOptions

from ab_sim.errors import InputError
from ab_sim.nodes import discovery


def init_ros(arguments: Sequence[str] | None = None) -> None:
    """``rclpy.init``: strict with arguments, and discovering on this machine only.

    Signals are left to ``ab_sim.interruption``; rclpy's own handlers would tear the context down
    under whatever is in flight.

    Args:
        arguments: the program and its arguments; default: those of the process.

    Raises:
        InputError: ROS would ignore one of them, or does not understand it.
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
        # rclpy's own exceptions, which it does not export.
        raise InputError(
            f"arguments {' '.join(given[1:])}: ROS does not understand them: {error}; a parameter "
            "is given as `--ros-args -p name:=value`"
        ) from error


def _outside_ros_args(arguments: Sequence[str]) -> list[str]:
    # `remove_ros_args` would take `scene:=x` for a renaming in the old style, and remove it.
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
