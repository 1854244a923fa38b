"""The services that `ab-sim node` can call, one row each; this module does not import ROS."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from ab_sim.base.errors import InputError
from ab_sim.base.numbers import number_in, whole_number_in

DRIVE, CONTROLLER = "drive_sim", "profile_controller"


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
    path = Path(text)
    return _file(text) if path.suffix in (".yaml", ".yml") or len(path.parts) > 1 else text


def _trigger() -> tuple[Any, Any]:
    from std_srvs.srv import Trigger

    from ab_msgs_py.services import trigger_request

    return Trigger, trigger_request()


def _switch(on: bool) -> tuple[Any, Any]:
    from std_srvs.srv import SetBool

    from ab_msgs_py.services import switch_request

    return SetBool, switch_request(on)


def _on() -> tuple[Any, Any]:
    return _switch(True)


def _off() -> tuple[Any, Any]:
    return _switch(False)


def _transition(label: str) -> Callable[[], tuple[Any, Any]]:
    def made() -> tuple[Any, Any]:
        from lifecycle_msgs.msg import Transition
        from lifecycle_msgs.srv import ChangeState

        return ChangeState, ChangeState.Request(transition=Transition(label=label))

    return made


class ServiceArgument(NamedTuple):
    """Argument of a command; it is set as a parameter of the node before the call."""

    parameter: str
    metavar: str
    meaning: str
    read: Callable[[str], Any] = str
    default: Any = ...
    """Default value; `...`: required, None: the parameter is left unchanged."""
    many: bool = False
    """True if it takes all remaining words, as a list."""


class ServiceCommand(NamedTuple):
    """Command that calls one service."""

    name: str
    """Name of the command; with underscores, it is also the default name of the service."""
    meaning: str
    node: str = DRIVE
    arguments: tuple[ServiceArgument, ...] = ()
    service: str = ""
    """Name of the service, if it differs from the command's; empty otherwise."""
    request: Callable[[], tuple[Any, Any]] = _trigger
    """Function that returns the service's type and the request."""
    timeout: float = 10.0
    """Time to wait for the answer [s]."""
    restores_parameters: bool = False
    """True if the parameters get their former values after the call."""
    urgent: bool = False
    """True if it is called without waiting for discovery, and repeated until there is an answer."""

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
                "Angle by which its unbalance leads that of the present disc [rad]. Default: 0.",
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
            ("shutdown", "End the node."),
        )
    ),
    ServiceCommand("start", "Start the speed profile.", CONTROLLER),
    ServiceCommand("abort", "Stop the speed profile, and ramp down to standstill.", CONTROLLER),
)
"""All services that the nodes offer; a test compares them with the nodes."""
