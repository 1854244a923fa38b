"""The services that `ab-sim node` can call, one row each; this module does not import ROS."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from ab_sim.errors import InputError

DRIVE, CONTROLLER = "drive_sim", "profile_controller"


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise InputError(f"{text!r}: must be a number") from error


def _whole(text: str) -> int:
    try:
        return int(text)
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
    """An argument of a command; it is set as a parameter of the node before the call."""

    parameter: str
    metavar: str
    read: Callable[[str], Any] = str
    default: Any = ...
    """Default value; `...`: required, None: the parameter is left unchanged."""
    many: bool = False
    """True if it takes all remaining words, as a list."""


class ServiceCommand(NamedTuple):
    """A command that calls one service."""

    name: str
    """Name of the command; with underscores the default name of the service."""
    meaning: str
    node: str = DRIVE
    arguments: tuple[ServiceArgument, ...] = ()
    service: str = ""
    """Name of the service, if it is another one."""
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


_SNAPSHOT = ServiceArgument("snapshot", "FILE", _file)
SERVICES = (
    ServiceCommand("pause", "Let simulated time stand still.", request=_on),
    ServiceCommand("resume", "Let it go on.", service="pause", request=_off),
    ServiceCommand(
        "step",
        "Take N wake-ups while time stands still; without N, as many as the node's parameter "
        "`steps` says. The answer is JSON.",
        arguments=(ServiceArgument("steps", "N", _whole, None),),
        timeout=600.0,
        restores_parameters=True,
    ),
    ServiceCommand("reset", "Back to t = 0 and the start; commands are forgotten."),
    ServiceCommand("reset-time", "Back to t = 0 in the present state."),
    ServiceCommand(
        "reset-state", "Back to the start's state, and time goes on; commands are forgotten."
    ),
    ServiceCommand(
        "load-scene",
        "Simulate another scene, from t = 0. It may have to be compiled first.",
        arguments=(
            ServiceArgument("scene", "SCENE", _scene),
            ServiceArgument("changes", "KEY=VALUE", default=[""], many=True),
        ),
        timeout=300.0,
    ),
    ServiceCommand(
        "load-disc",
        "Put in a disc of another eccentricity [m], its unbalance by an angle [rad] ahead of that "
        "of the disc before.",
        arguments=(
            ServiceArgument("disc_eccentricity", "ECCENTRICITY", _number),
            ServiceArgument("disc_angle", "ANGLE", _number, 0.0),
        ),
        timeout=300.0,
    ),
    ServiceCommand(
        "inject-faults",
        "Break these from now on, instead of what is broken: 'ball_1 sticks', "
        "'vibration drifts 0.1' ...",
        arguments=(ServiceArgument("faults", "FAULT", many=True),),
        timeout=300.0,
    ),
    ServiceCommand("clear-faults", "Mend all of them.", timeout=300.0),
    ServiceCommand(
        "save", "Save the present to a .json file.", arguments=(_SNAPSHOT,), service="save_snapshot"
    ),
    ServiceCommand(
        "restore", "Back to what a file holds.", arguments=(_SNAPSHOT,), service="restore_snapshot"
    ),
    ServiceCommand(
        "emergency-stop",
        "To standstill as fast as the spindle can; commands are ignored from then on.",
        urgent=True,
    ),
    ServiceCommand("reset-emergency-stop", "Let commands be followed again."),
    *(
        ServiceCommand(
            label,
            meaning,
            service="change_state",
            request=_transition(label),
            timeout=300.0,
        )
        for label, meaning in (
            ("configure", "Load the scene of the node's parameters, and compile it."),
            ("activate", "Let time go on, of a drive that is configured."),
            ("deactivate", "Let it stand still, and answer no commands."),
            ("cleanup", "Unload the scene."),
            ("shutdown", "End the node."),
        )
    ),
    ServiceCommand("start", "Run the profile.", CONTROLLER),
    ServiceCommand("abort", "Stop the profile, and ramp down to standstill.", CONTROLLER),
)
"""All services of the contract; a test compares."""
