"""`ab-sim node`: a command for each service of running nodes."""

import importlib
from inspect import Parameter
from typing import Annotated, Any, NamedTuple

from typer import Argument, Option

from ab_sim.cli.declare import Heading, parameter, set_signature
from ab_sim.cli.node_services import DRIVE, SERVICES, ServiceArgument, ServiceCommand

node_commands = Heading(
    "Commands",
    short_help="Command a running drive's speed; pause, step or reset nodes.",
    help="Command a running drive's speed, or ask nodes to pause, step, start and so on. Exit "
    "codes: 0 done, 1 refused by the node, 2 bad input or no such node.",
    no_args_is_help=True,
)
NEGATIVE_NUMBERS = {"ignore_unknown_options": True}
"""Settings of a command for which a negative number is an argument."""
_WORK = "ab_sim.cli.node"
"""Module that does the work, imported on the call, because ROS takes long to import."""
Namespace = Annotated[str, Option(metavar="NAME", help="ROS namespace of the node, e.g. left.")]
Node = Annotated[str, Option("--node", metavar="NAME", help="Name of the ROS node.")]
Wait = Annotated[
    float, Option(metavar="SECONDS", help="Longest time to wait for a node to be found [s].")
]


def _add(service: ServiceCommand) -> None:
    def command(namespace: str, node: str, wait: float, **words: Any) -> None:
        importlib.import_module(_WORK).call_service(service, words, namespace, node, wait)

    options = [
        parameter("namespace", Namespace, ""),
        parameter("node", Node, service.node),
        parameter("wait", Wait, 5.0),
    ]
    set_signature(command, [*map(_argument, service.arguments), *options])
    settings = NEGATIVE_NUMBERS if service.arguments else {}
    node_commands.command(service.name, help=service.meaning, context_settings=settings)(command)


def _argument(argument: ServiceArgument) -> Parameter:
    kind: Any = list[str] if argument.many else str
    info = Argument(metavar=argument.metavar, help=argument.meaning, show_default=False)
    if argument.default is ...:
        return parameter(argument.parameter, Annotated[kind, info])
    return parameter(argument.parameter, Annotated[kind | None, info], None)


for _service in SERVICES:
    _add(_service)


@node_commands.declare(f"{_WORK}:speed_command", context_settings=NEGATIVE_NUMBERS)
class CommandOptions(NamedTuple):
    """Command the spindle's speed, as firmware does, and print the drive's reaction.

    Publishes one message on the drive's topic spindle/command. The drive changes its speed with the
    largest acceleration allowed, and holds the new speed until the next command.

    Args:
        speed SPEED: Target speed [rad/s]; or with a unit, e.g. '1500 rpm'.
    """

    speed: Annotated[str, Argument()]
    namespace: Namespace = ""
    node: Node = DRIVE
    wait: Wait = 5.0


@node_commands.declare(f"{_WORK}:set_command")
class SetOptions(NamedTuple):
    """Set ROS parameters of a node; if the node refuses one, none is set.

    Args:
        values NAME=VALUE...: Parameters with their new values in YAML, e.g. speed_factor=2.0.
    """

    values: Annotated[list[str], Argument()]
    namespace: Namespace = ""
    node: Node = DRIVE
    wait: Wait = 5.0


@node_commands.declare(f"{_WORK}:get_command")
class GetOptions(NamedTuple):
    """Print ROS parameters of a node in the form of a parameter file.

    Args:
        names [NAME]...: Names of parameters. Default: all.
    """

    names: Annotated[list[str] | None, Argument(show_default=False)] = None
    namespace: Namespace = ""
    node: Node = DRIVE
    wait: Wait = 5.0


@node_commands.declare(f"{_WORK}:list_command")
class ListOptions(NamedTuple):
    """List the running nodes with their state, and the commands that they accept.

    Waits until all nodes on this machine have reported; each reports once a second. If the number
    of nodes is unknown, the command waits for the whole time.
    """

    wait: Wait = 4.0
