"""`ab-sim node`: a command for each service of running nodes."""

import importlib
from collections.abc import Callable
from inspect import Parameter
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from typer import Argument, Option

from ab_sim.base.errors import InputError
from ab_sim.base.numbers import number_in, whole_number_in
from ab_sim.cli.declare import Heading, parameter, set_signature

DRIVE, _CONTROLLER = "drive_sim", "profile_controller"
"""Default names of the nodes."""


def _number(text: str) -> float:
    try:
        return number_in(text)
    except ValueError as error:
        raise InputError(f"{text!r}: must be a number") from error


def _whole(text: str) -> int:
    try:
        return whole_number_in(text)
    except ValueError as error:
        raise InputError(f"{text!r}: must be a whole number") from error


def _file(text: str) -> str:
    """Return an absolute path, because the node may run in another folder."""
    return str(Path(text).expanduser().absolute())


def _scene(text: str) -> str:
    """Return a scene's name unchanged, and a file as an absolute path."""
    path = Path(text)
    return _file(text) if path.suffix in (".yaml", ".yml") or len(path.parts) > 1 else text


def _trigger() -> tuple[Any, Any]:
    """Return type and request of a Trigger service."""
    from std_srvs.srv import Trigger

    from ab_msgs_py.services import trigger_request

    return Trigger, trigger_request()


def _switch(on: bool) -> tuple[Any, Any]:
    """Return type and request of a SetBool service."""
    from std_srvs.srv import SetBool

    from ab_msgs_py.services import switch_request

    return SetBool, switch_request(on)


def _on() -> tuple[Any, Any]:
    return _switch(True)


def _off() -> tuple[Any, Any]:
    return _switch(False)


def _transition(label: str) -> Callable[[], tuple[Any, Any]]:
    """Return a function that returns type and request of a lifecycle transition."""

    def request() -> tuple[Any, Any]:
        from lifecycle_msgs.msg import Transition
        from lifecycle_msgs.srv import ChangeState

        return ChangeState, ChangeState.Request(transition=Transition(label=label))

    return request


class ServiceArgument(NamedTuple):
    """Argument of a command; it is set as a parameter of the node before the call."""

    parameter: str
    """Name of the node's parameter."""
    metavar: str
    meaning: str
    read: Callable[[str], Any] = str
    """Function that converts a word to the parameter's value."""
    default: Any = ...
    """Default value; `...`: required, None: the parameter is left unchanged."""
    many: bool = False
    """True if the argument takes all remaining words, as a list."""


class ServiceCommand(NamedTuple):
    """Command that calls one service."""

    name: str
    """Name of the command; with underscores, it is also the default name of the service."""
    meaning: str
    node: str = DRIVE
    """Default name of the node."""
    arguments: tuple[ServiceArgument, ...] = ()
    service: str = ""
    """Name of the service, if it differs from the command's name; empty otherwise."""
    request: Callable[[], tuple[Any, Any]] = _trigger
    """Function that returns the service's type and the request."""
    timeout: float = 10.0
    """Time to wait for the answer [s]."""
    restores_parameters: bool = False
    """True if the node's parameters get their former values again after the call."""
    urgent: bool = False
    """True if the call does not wait for discovery, and is repeated until there is an answer."""

    @property
    def service_name(self) -> str:
        """Return the name of the service."""
        return self.service or self.name.replace("-", "_")


SERVICES = (
    ServiceCommand("pause", "Stop simulated time.", request=_on),
    ServiceCommand("resume", "Continue simulated time.", service="pause", request=_off),
    ServiceCommand(
        "step",
        "Simulate N wake-ups of the node while simulated time is stopped; the answer is JSON.",
        arguments=(
            ServiceArgument(
                "steps",
                "N",
                "Number of wake-ups; each is 4 ms with wake_rate 250. Default: the node's "
                "parameter `steps`.",
                _whole,
                None,
            ),
        ),
        timeout=600.0,
        restores_parameters=True,
    ),
    ServiceCommand("reset", "Return to t = 0 and the start state; discard all commands."),
    ServiceCommand("reset-time", "Return to t = 0, and keep the present state."),
    ServiceCommand(
        "reset-state", "Return to the start state, at the present time; discard all commands."
    ),
    ServiceCommand(
        "load-scene",
        "Simulate another scene from t = 0; compiling it may take some seconds.",
        arguments=(
            ServiceArgument(
                "scene", "SCENE", "Scene: a name from `ab-sim scenes`, or a YAML file.", _scene
            ),
            ServiceArgument(
                "changes",
                "KEY=VALUE",
                "Changes of the scene, as in `ab-sim run --set`.",
                default=[""],
                many=True,
            ),
        ),
        timeout=300.0,
    ),
    ServiceCommand(
        "load-disc",
        "Load another disc.",
        arguments=(
            ServiceArgument(
                "disc_eccentricity", "ECCENTRICITY", "Eccentricity of the disc [m].", _number
            ),
            ServiceArgument(
                "disc_angle",
                "ANGLE",
                "Angle by which the new disc's unbalance leads the present one [rad]. Default: 0.",
                _number,
                0.0,
            ),
        ),
        timeout=300.0,
    ),
    ServiceCommand(
        "inject-faults",
        "Inject faults, in place of all earlier ones, e.g. 'ball_1 sticks' 'vibration drifts 0.1'.",
        arguments=(
            ServiceArgument(
                "faults",
                "FAULT",
                "Fault: object, fault and size, in quotes; docs/topics.md has a list.",
                many=True,
            ),
        ),
        timeout=300.0,
    ),
    ServiceCommand("clear-faults", "Clear all faults.", timeout=300.0),
    ServiceCommand(
        "save",
        "Save the present state to a file.",
        arguments=(ServiceArgument("snapshot", "FILE", "File to write: .json.", _file),),
        service="save_snapshot",
    ),
    ServiceCommand(
        "restore",
        "Return to a saved state.",
        arguments=(
            ServiceArgument(
                "snapshot", "FILE", "File written by `ab-sim node save`: .json.", _file
            ),
        ),
        service="restore_snapshot",
    ),
    ServiceCommand(
        "emergency-stop",
        "Stop the spindle as fast as possible; ignore commands until reset-emergency-stop.",
        urgent=True,
    ),
    ServiceCommand("reset-emergency-stop", "Follow commands again after an emergency stop."),
    *(
        ServiceCommand(
            label,
            meaning,
            service="change_state",
            request=_transition(label),
            timeout=300.0,
        )
        for label, meaning in (
            ("configure", "Load and compile the scene that the node's parameters name."),
            ("activate", "Start simulated time of a configured drive."),
            ("deactivate", "Stop simulated time; commands are ignored."),
            ("cleanup", "Unload the scene."),
            ("shutdown", "Shut the node down."),
        )
    ),
    ServiceCommand("start", "Start the speed profile.", _CONTROLLER),
    ServiceCommand("abort", "Stop the speed profile, and ramp down to standstill.", _CONTROLLER),
)
"""All services that the nodes offer; a test compares them with the nodes."""


node_commands = Heading(
    "Commands",
    short_help="Command a running drive's speed; pause, step or reset nodes.",
    help="Command a running drive's speed, or ask nodes to pause, step, start and so on. Exit "
    "codes: 0 done, 1 refused by the node, 2 bad input or no such node.",
    no_args_is_help=True,
)
_NEGATIVE_NUMBERS = {"ignore_unknown_options": True}
"""Settings of a command for which a negative number is an argument."""
_WORK = "ab_sim.cli.node"
"""Module that does the work, imported on the call, because ROS takes long to import."""
Namespace = Annotated[str, Option(metavar="NAME", help="ROS namespace of the node, e.g. /left.")]
Node = Annotated[str, Option("--node", metavar="NAME", help="Name of the ROS node.")]
Wait = Annotated[
    float, Option(metavar="SECONDS", help="Longest time to wait for a node to be found [s].")
]


def _add(service: ServiceCommand) -> None:
    """Add the command of a service to `ab-sim node`."""

    def command(namespace: str, node: str, wait: float, **words: Any) -> None:
        importlib.import_module(_WORK).call_service(service, words, namespace, node, wait)

    options = [
        parameter("namespace", Namespace, ""),
        parameter("node", Node, service.node),
        parameter("wait", Wait, 5.0),
    ]
    set_signature(command, [*map(_argument, service.arguments), *options])
    settings = _NEGATIVE_NUMBERS if service.arguments else {}
    node_commands.command(service.name, help=service.meaning, context_settings=settings)(command)


def _argument(argument: ServiceArgument) -> Parameter:
    """Return typer's parameter for an argument of a service."""
    kind: Any = list[str] if argument.many else str
    info = Argument(metavar=argument.metavar, help=argument.meaning, show_default=False)
    if argument.default is ...:
        return parameter(argument.parameter, Annotated[kind, info])
    return parameter(argument.parameter, Annotated[kind | None, info], None)


for _service in SERVICES:
    _add(_service)


@node_commands.declare(f"{_WORK}:speed_command", context_settings=_NEGATIVE_NUMBERS)
class CommandOptions(NamedTuple):
    """Command the spindle's speed, as firmware does, and print the drive's reaction.

    Publishes one message on the drive's topic spindle/command. The drive changes its speed with the
    largest acceleration allowed, and holds the new speed until the next command.

    Parameters
    ----------
    speed SPEED
        Target speed [rad/s]; or with a unit, e.g. '1500 rpm'.
    """

    speed: Annotated[str, Argument()]
    namespace: Namespace = ""
    node: Node = DRIVE
    wait: Wait = 5.0


@node_commands.declare(f"{_WORK}:set_command")
class SetOptions(NamedTuple):
    """Set ROS parameters of a node; if the node refuses one, none is set.

    Parameters
    ----------
    values NAME=VALUE...
        Parameters with their new values in YAML, e.g. speed_factor=2.0.
    """

    values: Annotated[list[str], Argument()]
    namespace: Namespace = ""
    node: Node = DRIVE
    wait: Wait = 5.0


@node_commands.declare(f"{_WORK}:get_command")
class GetOptions(NamedTuple):
    """Print ROS parameters of a node in the form of a parameter file.

    Parameters
    ----------
    names [NAME]...
        Names of parameters. Default: all.
    """

    names: Annotated[list[str] | None, Argument(show_default=False)] = None
    namespace: Namespace = ""
    node: Node = DRIVE
    wait: Wait = 5.0


@node_commands.declare(f"{_WORK}:list_command")
class ListOptions(NamedTuple):
    """List the running nodes with their state, and the commands that they accept.

    Waits until all nodes on this machine have reported; each reports once a second. If the number
    of nodes is unknown, the command waits as long as --wait allows.
    """

    wait: Wait = 4.0
