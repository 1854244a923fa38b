"""`ab-sim node`: a command for each service of running nodes."""

import inspect
from typing import Annotated, Any

import typer

from ab_sim.cli.node_services import DRIVE, SERVICES, ServiceArgument, ServiceCommand

node_commands = typer.Typer(
    short_help="Command a running drive's speed; pause, step or reset nodes.",
    help="Command a running drive's speed, or ask nodes to pause, step, start and so on. Exit "
    "codes: 0 done, 1 refused by the node, 2 bad input or nobody there.",
    no_args_is_help=True,
)
NamespaceOption = Annotated[
    str, typer.Option(metavar="NAME", help="The node's namespace, e.g. left.")
]
NodeOption = Annotated[str, typer.Option(metavar="NAME", help="The node's name.")]
WaitOption = Annotated[
    float, typer.Option(metavar="SECONDS", help="How long to wait for the node to be found.")
]


def _add(service: ServiceCommand) -> None:
    def command(namespace: str, node: str, wait: float, **words: Any) -> None:
        from ab_sim.cli.node import call_service

        call_service(service, words, namespace, node, wait)

    # typer reads this signature
    arguments = [
        _parameter(
            argument.parameter, _argument(argument), ... if argument.default is ... else None
        )
        for argument in service.arguments
    ]
    options = [
        _parameter("namespace", NamespaceOption, ""),
        _parameter("node", NodeOption, service.node),
        _parameter("wait", WaitOption, 5.0),
    ]
    whole = [*arguments, *options]
    command.__signature__ = inspect.Signature(whole)  # type: ignore[attr-defined]
    command.__annotations__ = {parameter.name: parameter.annotation for parameter in whole}
    # A negative number is not an option.
    settings = {"ignore_unknown_options": True} if service.arguments else {}
    node_commands.command(service.name, help=service.meaning, context_settings=settings)(command)


def _argument(argument: ServiceArgument) -> Any:
    kind = list[str] if argument.many else str
    optional = argument.default is not ...
    return Annotated[kind | None if optional else kind, typer.Argument(metavar=argument.metavar)]


def _parameter(name: str, annotation: Any, default: Any) -> inspect.Parameter:
    default_or_empty = inspect.Parameter.empty if default is ... else default
    kind = inspect.Parameter.KEYWORD_ONLY
    return inspect.Parameter(name, kind, default=default_or_empty, annotation=annotation)


for _service in SERVICES:
    _add(_service)


@node_commands.command("command", context_settings={"ignore_unknown_options": True})
def command_(
    speed: Annotated[
        str,
        typer.Argument(metavar="SPEED", help="Target speed [rad/s], or with a unit, '1500 rpm'."),
    ],
    namespace: NamespaceOption = "",
    node: NodeOption = DRIVE,
    wait: WaitOption = 5.0,
) -> None:
    """Command the spindle's speed, as firmware does, and say what the drive does.

    It publishes one message on the drive's topic spindle/command. The drive accelerates at its
    limit, and holds the speed until another command.
    """
    from ab_sim.cli.node import speed_command

    speed_command(speed, namespace, node, wait)


@node_commands.command("set")
def set_(
    values: Annotated[list[str], typer.Argument(metavar="NAME=VALUE...")],
    namespace: NamespaceOption = "",
    node: NodeOption = DRIVE,
    wait: WaitOption = 5.0,
) -> None:
    """Set parameters of a node, all or none; values are written as in YAML."""
    from ab_sim.cli.node import set_command

    set_command(values, namespace, node, wait)


@node_commands.command()
def get(
    names: Annotated[list[str] | None, typer.Argument(metavar="[NAME]...")] = None,
    namespace: NamespaceOption = "",
    node: NodeOption = DRIVE,
    wait: WaitOption = 5.0,
) -> None:
    """Print parameters of a node, all if none is named, as a parameter file has them."""
    from ab_sim.cli.node import get_command

    get_command(names or (), namespace, node, wait)


@node_commands.command("list")
def list_(wait: WaitOption = 4.0) -> None:
    """List the nodes that can be asked, what they say of themselves, and what they can do.

    It waits until all on this machine have spoken, which they do once a second, and as long as it
    may only where it cannot know how many there are.
    """
    from ab_sim.cli.node import list_command

    list_command(wait)
