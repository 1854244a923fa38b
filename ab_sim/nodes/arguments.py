"""Command line of a node: arguments that ROS would silently ignore are errors."""

import os
import re
import sys
from collections.abc import Sequence

import rclpy
from rclpy.signals import SignalHandlerOptions

from ab_sim.base.errors import InputError, visible
from ab_sim.nodes import discovery
from ab_sim.nodes.participants import stuck_ports, unheard_users

SECURITY = "ROS_SECURITY_ENABLE"
"""Environment variable that turns on ROS's security (SROS 2)."""
MOST_DOMAIN = 232
"""Largest domain id whose UDP port numbers exist (DDSI-RTPS, 9.6.2)."""
UNREADABLE = re.compile(r"params file: '--params-file (.+)'\. Error: (.+?)\s*, at /", re.DOTALL)
"""Part of rcl's error that names a parameter file and what is wrong with it."""


def init_ros(arguments: Sequence[str] | None = None) -> None:
    """Call ``rclpy.init`` with strict arguments and discovery on this machine only.

    ``ab_sim.base.interruption`` handles signals. rclpy's own handlers would shut down the context
    while messages are in flight.

    Args:
        arguments: program and arguments; default: those of the process.

    Raises:
        InputError: ROS would ignore an argument, or does not understand it; the domain is invalid,
            or ROS cannot write its log.
    """
    argument_list = sys.argv if arguments is None else arguments
    if stray := _outside_ros_args(argument_list[1:]):
        raise InputError(
            f"argument {stray[0]!r}: is unknown; parameters come after --ros-args, each after "
            f"-p: `--ros-args -p {_as_parameter(stray[0])}`"
        )
    _check_domain()
    _check_security()
    discovery.prepare()
    for warning in (discovery.unused_transports(), unheard_users(), stuck_ports()):
        if warning:
            print(visible(warning), file=sys.stderr)
    try:
        rclpy.init(args=list(argument_list), signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:
        # rclpy does not export its own exceptions.
        if "initialize logging" in str(error) or "for writing" in str(error):
            raise InputError(
                f"ROS cannot write its log: {error}; set ROS_LOG_DIR to a folder in which this "
                "user can write"
            ) from error
        if "SECURITY ERROR" in str(error):
            raise InputError(
                f"{SECURITY} = 'true': {error}; set ROS_SECURITY_KEYSTORE to a keystore with an "
                f"enclave for this node, or unset {SECURITY}"
            ) from error
        if unreadable := UNREADABLE.search(str(error)):
            raise InputError(
                f"parameter file {unreadable[1]}: ROS cannot read it: {unreadable[2]}; it must be "
                "YAML of the form `NODE: {ros__parameters: {name: value}}`, without anchors"
            ) from error
        raise InputError(
            f"arguments {' '.join(argument_list[1:])}: ROS does not understand them: {error}; a "
            "parameter is given as `--ros-args -p name:=value`"
        ) from error


def _check_domain() -> None:
    domain = os.environ.get("ROS_DOMAIN_ID", "")
    if domain and not (domain.isdecimal() and int(domain) <= MOST_DOMAIN):
        raise InputError(
            f"ROS_DOMAIN_ID = {domain!r}: must be a whole number from 0 to {MOST_DOMAIN}; set "
            "another one, or unset it for 0"
        )


def _check_security() -> None:
    if os.environ.get(SECURITY, "").lower() == "true" and discovery.from_pypi():
        raise InputError(
            f"{SECURITY} = {os.environ[SECURITY]!r}: the Fast DDS from PyPI has no security "
            "plug-ins (SROS 2); unset it, or use the ROS 2 of a distribution"
        )


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
