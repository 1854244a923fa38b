"""What `ab-sim node` can ask running nodes for, one row each; nothing here needs ROS to be read."""

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
    """The node may be at home in another folder."""
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


class Taken(NamedTuple):
    """What a command is told, which becomes a parameter of the node before it is asked."""

    parameter: str
    metavar: str
    read: Callable[[str], Any] = str
    default: Any = ...
    """Set where nothing is told; `...`: it has to be told, None: the parameter stays as it is."""
    many: bool = False
    """All that is left, as a list."""


class Act(NamedTuple):
    """One service that can be asked for."""

    name: str
    """Of the command; the service is called so, too, with underscores."""
    meaning: str
    node: str = DRIVE
    takes: tuple[Taken, ...] = ()
    service: str = ""
    """Where it is called otherwise."""
    request: Callable[[], tuple[Any, Any]] = _trigger
    """Makes the service's type, and the request."""
    patience: float = 10.0
    """s for the answer."""
    put_back: bool = False
    """Whether the parameters are afterwards what they were."""
    urgent: bool = False
    """To be asked at once, and again until there is an answer."""

    @property
    def asks(self) -> str:
        """The service's name."""
        return self.service or self.name.replace("-", "_")


_SNAPSHOT = Taken("snapshot", "FILE", _file)
ACTS = (
    Act("pause", "Let simulated time stand still.", request=_on),
    Act("resume", "Let it go on.", service="pause", request=_off),
    Act(
        "step",
        "Take N wake-ups while time stands still; without N, as many as the node's parameter "
        "`steps` says. The answer is JSON.",
        takes=(Taken("steps", "N", _whole, None),),
        patience=600.0,
        put_back=True,
    ),
    Act("reset", "Back to t = 0 and the start; commands are forgotten."),
    Act("reset-time", "Back to t = 0 in the present state."),
    Act("reset-state", "Back to the start's state, and time goes on; commands are forgotten."),
    Act(
        "load-scene",
        "Simulate another scene, from t = 0. It may have to be compiled first.",
        takes=(
            Taken("scene", "SCENE", _scene),
            Taken("changes", "KEY=VALUE", default=[""], many=True),
        ),
        patience=300.0,
    ),
    Act(
        "load-disc",
        "Put in a disc of another eccentricity [m], its unbalance by an angle [rad] ahead of that "
        "of the disc before.",
        takes=(
            Taken("disc_eccentricity", "ECCENTRICITY", _number),
            Taken("disc_angle", "ANGLE", _number, 0.0),
        ),
        patience=300.0,
    ),
    Act(
        "inject-faults",
        "Break these from now on, instead of what is broken: 'ball_1 sticks', "
        "'vibration drifts 0.1' ...",
        takes=(Taken("faults", "FAULT", many=True),),
        patience=300.0,
    ),
    Act("clear-faults", "Mend all of them.", patience=300.0),
    Act("save", "Save the present to a .json file.", takes=(_SNAPSHOT,), service="save_snapshot"),
    Act("restore", "Back to what a file holds.", takes=(_SNAPSHOT,), service="restore_snapshot"),
    Act(
        "emergency-stop",
        "To standstill as fast as the spindle can; commands are ignored from then on.",
        urgent=True,
    ),
    Act("reset-emergency-stop", "Let commands be followed again."),
    *(
        Act(
            label,
            meaning,
            service="change_state",
            request=_transition(label),
            patience=300.0,
        )
        for label, meaning in (
            ("configure", "Load the scene of the node's parameters, and compile it."),
            ("activate", "Let time go on, of a drive that is configured."),
            ("deactivate", "Let it stand still, and answer no commands."),
            ("cleanup", "Unload the scene."),
            ("shutdown", "End the node."),
        )
    ),
    Act("start", "Run the profile.", CONTROLLER),
    Act("abort", "Stop the profile, and ramp down to standstill.", CONTROLLER),
)
"""A service that is not here cannot be asked for by `ab-sim node`; a test compares."""
