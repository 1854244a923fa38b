"""`ab-sim node`: call services of running nodes, command drives, and print the answers."""

import contextlib
import json
import math
import re
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from rich.table import Table

from ab_sim.base.errors import AbSimError, InputError, Interrupted, Refused, short, visible
from ab_sim.base.numbers import number_in
from ab_sim.base.yaml_files import read_yaml
from ab_sim.cli.checks import require_ros
from ab_sim.cli.node_commands import (
    SERVICES,
    CommandOptions,
    GetOptions,
    ListOptions,
    ServiceCommand,
    SetOptions,
)
from ab_sim.cli.outputs import people, results
from ab_sim.scene.units import has_unit, in_si

if TYPE_CHECKING:
    from ab_sim.nodes.caller import Caller

_AGAIN = 0.5
"""Time after which an urgent request is repeated [s]."""
_EXPONENT = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+", re.ASCII)
_NAME = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_NAMESPACE = re.compile(r"/?|/?[A-Za-z_]\w*(/[A-Za-z_]\w*)*/?", re.ASCII)


def call_service(
    command: ServiceCommand, words: Mapping[str, Any], namespace: str, name: str, wait: float
) -> None:
    """Set the node's parameters that a service reads, call the service, and print the answer.

    Parameters
    ----------
    command
        Command that calls the service.
    words
        Arguments of the command, by parameter.
    namespace
        ROS namespace of the node.
    name
        Name of the node.
    wait
        Longest time to wait for the node [s].

    Raises
    ------
    InputError
        An argument is invalid, or the node is not running.
    Refused
        The node refused; the text is its answer.
    """
    values = parameter_values(command, words)
    with _calling(namespace, name, wait) as (caller, node):
        from ab_sim.nodes.caller import PARAMETERS

        kind, request = command.request()
        needed = PARAMETERS if values else {}
        caller.wait_for_services(node, {command.service_name: kind, **needed}, command.urgent)
        before = caller.parameters([*values]) if values else {}
        restore = command.restores_parameters
        try:
            if values:
                caller.set(values)
            again = _AGAIN if command.urgent else 0.0
            answer = caller.call(command.service_name, request, command.timeout, again)
            restore = restore or not answer.success  # a refused call changes nothing
        except Interrupted:
            caller.clear_interrupt()
            raise
        finally:
            if before and restore:
                with contextlib.suppress(AbSimError):  # an exited node has reported its reason
                    caller.set(before)
    # answers of ROS's lifecycle services have no message
    text = str(getattr(answer, "message", ""))
    if not answer.success:
        raise Refused(text or f"{node}/{command.service_name}: refused, without a reason")
    print(visible(text) or "done")


def parameter_values(command: ServiceCommand, words: Mapping[str, Any]) -> dict[str, Any]:
    """Return the node's parameters that the command's arguments set, by name.

    Raises
    ------
    InputError
        An argument is invalid.
    """
    values = {}
    for argument in command.arguments:
        argument_value = words[argument.parameter]
        argument_words: list[str] = (
            []
            if argument_value is None
            else list(argument_value)
            if argument.many
            else [argument_value]
        )
        if stray := next((word for word in argument_words if re.match(r"--?[A-Za-z]", word)), None):
            raise InputError(f"{stray}: `ab-sim node {command.name}` has no such option")
        read = [argument.read(word) for word in argument_words]
        value = argument.default if not read else read if argument.many else read[0]
        if value is not None:
            values[argument.parameter] = value
    return values


def set_command(options: SetOptions) -> None:
    """Set parameters of a node.

    Raises
    ------
    InputError
        An argument is invalid, or the node is not running.
    Refused
        The node refused; the text is its answer.
    """
    values = {}
    for word in options.values:
        key, equals, text = word.partition("=")
        if not equals or not key.strip():
            raise InputError(f"{word!r}: must be NAME=VALUE, e.g. speed_factor=2.0")
        if key.strip() in values:
            raise InputError(f"{key.strip()}: is given twice; keep one")
        values[key.strip()] = value_of(text)
    with _calling(options.namespace, options.node, options.wait) as (caller, node):
        from ab_sim.nodes.caller import PARAMETERS

        caller.wait_for_services(node, PARAMETERS)
        caller.set(values)
    print("set")


def value_of(text: str) -> Any:
    """Return the value of a word in YAML.

    Unlike in YAML, `1e-4` is a number. A mapping, such as a profile in braces, remains a text,
    because no parameter of a node is a mapping.

    Raises
    ------
    InputError
        The text is not YAML.
    """
    try:
        value = float(text) if _EXPONENT.fullmatch(text.strip()) else read_yaml(text)
        return text if isinstance(value, dict) else value
    except ValueError as error:
        raise InputError(f"{short(text)}: the value {error}") from error


def get_command(options: GetOptions) -> None:
    """Print parameters of a node.

    Raises
    ------
    InputError
        An argument is invalid, or the node is not running.
    """
    with _calling(options.namespace, options.node, options.wait) as (caller, node):
        from ab_sim.nodes.caller import PARAMETERS

        caller.wait_for_services(node, PARAMETERS)
        values = caller.parameters(options.names or ())
    for key, value in values.items():
        print(visible(f"{key}: {_written(value)}"))


@contextlib.contextmanager
def _calling(namespace: str, name: str, wait: float) -> Iterator[tuple["Caller", str]]:
    """Yield a service client and the full name of the node that it calls."""
    node = _full_name(namespace, name, wait)
    from ab_sim.nodes.caller import Caller

    with Caller(wait) as caller, people.status(f"calling {node}"):
        yield caller, node


def speed_command(options: CommandOptions) -> None:
    """Command a drive's speed, and print the drive's reaction.

    Raises
    ------
    InputError
        An argument is invalid, or no drive is running.
    CommandError
        The speed exceeds the drive's limit.
    Refused
        The drive does not follow commands now.
    """
    speed = _speed(options.speed)
    node = _full_name(options.namespace, options.node, options.wait)
    from ab_sim.nodes.caller import SpeedCaller

    caller = SpeedCaller(options.wait)
    with caller, people.status(f"commanding {node}"):
        accepted = caller.command(node, speed)
    limits, start = accepted.limits, accepted.before
    origin, ramp = "", ""
    if start is not None:
        origin = f"from {start:.4g} "
        ramp = f", {abs(speed - start) / limits.max_acceleration:.3g} s"
    print(
        f"accepted: {origin}to {speed:.6g} rad/s, at {limits.max_acceleration:.4g} rad/s^2{ramp}; "
        f"limit {limits.max_speed:.6g} rad/s"
    )
    if accepted.standing:
        people.print("the drive's time is stopped; `ab-sim node resume` continues it")
    if accepted.other_sources:
        people.print(
            f"other publishers of commands: {accepted.other_sources}; the newest command counts"
        )


def _speed(text: str) -> float:
    """Return a speed [rad/s] from text such as `150` or `1500 rpm`.

    Raises
    ------
    InputError
        The text is not a finite number, or its unit is not a unit of angular speed.
    """
    if re.match(r"--?[A-Za-z]", text):
        raise InputError(f"{text}: `ab-sim node command` has no such option")
    try:
        speed = in_si(text, "rad/s") if has_unit(text) else number_in(text)
    except ValueError as error:
        must = "must be a number, in rad/s or with a unit, e.g. 150 or '1500 rpm'"
        reason = str(error) if has_unit(text) else must
        raise InputError(f"SPEED {short(text)}: {reason}") from error
    if not math.isfinite(speed):
        raise InputError(f"SPEED {text}: must be a finite number")
    return speed


def list_command(options: ListOptions) -> None:
    """Print the running nodes and their services.

    Raises
    ------
    InputError
        ``--wait`` is invalid, or no node is running.
    """
    _check_wait(options.wait)
    require_ros("to list nodes")
    from ab_sim.nodes.caller import Caller

    with Caller(options.wait) as caller, people.status("listening"):
        health = caller.collect_health()
        nodes, nobody = caller.nodes(), caller.no_nodes_text
    service_names = {service.service_name for service in SERVICES}
    rows = 0
    table = Table("node", "state", "message", "commands")
    for node, offers in sorted(nodes.items()):
        if not (service_names & set(offers) or node in health):
            continue
        rows += 1
        values = health.get(node)
        can = [service.name for service in SERVICES if service.service_name in offers]
        level = values.level.name if values is not None else "-"
        table.add_row(
            node, level, values.message if values is not None else "-", ", ".join(can) or "-"
        )
    if not rows:
        others = f"found {', '.join(sorted(nodes))}" if nodes else nobody
        raise InputError(f"no node of ab_sim was found; {others}")
    results.print(table)


def _full_name(namespace: str, name: str, wait: float) -> str:
    """Check ``--namespace``, ``--node`` and ``--wait``, and return the full name of the node."""
    if not _NAMESPACE.fullmatch(namespace):
        raise InputError(f"--namespace {namespace}: must be words between slashes, e.g. /left")
    if not _NAME.fullmatch(name):
        raise InputError(
            f"--node {name}: must be one word; give the part before it with --namespace"
        )
    _check_wait(wait)
    require_ros("to call nodes")
    return "/".join(["", *filter(None, namespace.split("/")), name])


def _check_wait(wait: float) -> None:
    """Refuse a time of ``--wait`` [s] that is not positive and finite."""
    if not 0.0 < wait < math.inf:
        raise InputError(f"--wait {wait:g}: must be more than 0 s and finite")


def _written(value: Any) -> str:
    """Return a value in YAML, as in a parameter file."""
    if isinstance(value, float) and not math.isfinite(value):
        return {math.inf: ".inf", -math.inf: "-.inf"}.get(value, ".nan")
    return "" if value is None else json.dumps(value, ensure_ascii=False)
