"""`ab-sim node`: a command for each service of running nodes."""

from inspect import Parameter
from typing import Annotated, Any

import typer
from typer import Argument, Option

from ab_sim.cli.declare import parameter, set_signature
from ab_sim.cli.node_services import DRIVE, SERVICES, ServiceArgument, ServiceCommand

node_commands = typer.Typer(
    short_help="Command a running drive's speed; pause, step or reset nodes.",
    help="Command a running drive's speed, or ask nodes to pause, step, start and so on. Exit "
    "codes: 0 done, 1 refused by the node, 2 bad input or no such node.",
    no_args_is_help=True,
)
Namespace = Annotated[str, Option(metavar="NAME", help="Namespace of the node, e.g. left.")]
Node = Annotated[str, Option("--node", metavar="NAME", help="Name of the node.")]
Wait = Annotated[float, Option(metavar="SECONDS", help="Time to wait until the node is found [s].")]


def _add(service: ServiceCommand) -> None:
    def command(namespace: str, node: str, wait: float, **words: Any) -> None:
        from ab_sim.cli.node import call_service

        call_service(service, words, namespace, node, wait)

    options = [
        parameter("namespace", Namespace, ""),
        parameter("node", Node, service.node),
        parameter("wait", Wait, 5.0),
    ]
    set_signature(command, [*map(_argument, service.arguments), *options])
    # A negative number is not an option.
    settings = {"ignore_unknown_options": True} if service.arguments else {}
    node_commands.command(service.name, help=service.meaning, context_settings=settings)(command)


def _argument(argument: ServiceArgument) -> Parameter:
    kind: Any = list[str] if argument.many else str
    info = Argument(metavar=argument.metavar)
    if argument.default is ...:
        return parameter(argument.parameter, Annotated[kind, info])
    return parameter(argument.parameter, Annotated[kind | None, info], None)


for _service in SERVICES:
    _add(_service)


@node_commands.command("command", context_settings={"ignore_unknown_options": True})
def _command(
    speed: Annotated[
        str,
        Argument(metavar="SPEED", help="Target speed [rad/s]; or with a unit, e.g. '1500 rpm'."),
    ],
    namespace: Namespace = "",
    node: Node = DRIVE,
    wait: Wait = 5.0,
) -> None:
    """Command the spindle's speed, as firmware does, and print the drive's reaction.

    It publishes one message on the drive's topic spindle/command. The drive accelerates at its
    limit, and holds the speed until another command.
    """
    from ab_sim.cli.node import speed_command

    speed_command(speed, namespace, node, wait)


@node_commands.command("set")
def _set(
    values: Annotated[list[str], Argument(metavar="NAME=VALUE...")],
    namespace: Namespace = "",
    node: Node = DRIVE,
    wait: Wait = 5.0,
) -> None:
    """Set parameters of a node, all or none; values are written as in YAML."""
    from ab_sim.cli.node import set_command

    set_command(values, namespace, node, wait)


@node_commands.command("get")
def _get(
    names: Annotated[list[str] | None, Argument(metavar="[NAME]...")] = None,
    namespace: Namespace = "",
    node: Node = DRIVE,
    wait: Wait = 5.0,
) -> None:
    """Print parameters of a node in the form of a parameter file. Default: all parameters."""
    from ab_sim.cli.node import get_command

    get_command(names or (), namespace, node, wait)


@node_commands.command("list")
def _list(wait: Wait = 4.0) -> None:
    """List the nodes with their state, and the commands that they offer.

    It waits until all nodes on this machine have reported, which they do once a second. It waits
    for the whole time only if it cannot know their number.
    """
    from ab_sim.cli.node import list_command

    list_command(wait)
