"""Parameters of a node as a table: meaning, unit, range, and whether they may change."""

from __future__ import annotations

import contextlib
import itertools
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from ab_sim.base.errors import AbSimError, InputError, nearest, short
from ab_sim.base.files import RECORDING, check_ending, check_folder, check_writable
from ab_sim.base.plug_ins import load_files
from ab_sim.base.yaml_files import read_yaml_file
from ab_sim.nodes.base_node import PARAMETERS, BaseNode
from ab_sim.scene.units import NO_UNIT

Values = Mapping[str, Any]
"""Values of parameters by name."""


class ParameterSpec(NamedTuple):
    """Name, type, meaning, unit and allowed values of a parameter."""

    name: str
    default: Any
    """Default value, which determines the type. An int is accepted for a float, and a text for a
    list of texts."""
    meaning: str
    """One line for users."""
    unit: str = ""
    """Unit; empty if the value is not a number."""
    allowed: tuple[float, float] | None = None
    """Smallest and largest allowed value; None: no limits."""
    choices: Sequence[str] = ()
    """Allowed texts; empty: any."""
    fixed: bool = False
    """True if the value cannot change after the node's start."""

    @property
    def allowed_text(self) -> str:
        """Description of the allowed values, for messages."""
        if self.choices:
            return "one of " + ", ".join(self.choices)
        if self.allowed is None:
            return _kind(self.default)
        unit = "" if self.unit in ("", *NO_UNIT) else f" {self.unit}"
        return f"{_kind(self.default)} from {self.allowed[0]:g} to {self.allowed[1]:g}{unit}"

    def checked(self, raw: Any) -> Any:
        """Return a value converted to the default's type.

        Raises
        ------
        InputError
            The value cannot be converted, or is not allowed.
        """
        value = _converted(raw, self.default)
        allowed = value is not None and (not self.choices or value in self.choices)
        if allowed and self.allowed is not None:
            allowed = self.allowed[0] <= value <= self.allowed[1]
        if not allowed:
            raise InputError(f"parameter {self.name} = {short(raw)}: must be {self.allowed_text}")
        return value

    def declare(self, node: Node) -> Any:
        """Declare the parameter at a node, and return its value.

        Raises
        ------
        InputError
            The value cannot be converted, or is not allowed.
        """
        descriptor = ParameterDescriptor(
            description=self.meaning + (f" [{self.unit}]" if self.unit else ""),
            additional_constraints=self.allowed_text if self.choices else "",
            read_only=self.fixed,
            # `checked` checks the type: ROS would refuse 250 for the default 250.0.
            dynamic_typing=True,
        )
        if self.allowed is not None:
            low, high = self.allowed
            if isinstance(self.default, int):
                whole = IntegerRange(from_value=int(low), to_value=int(high))
                descriptor.integer_range = [whole]
            else:
                span = FloatingPointRange(from_value=low, to_value=high)
                descriptor.floating_point_range = [span]
        try:
            value = node.declare_parameter(self.name, self.default, descriptor).value
        except Exception as error:
            # rclpy raises various exception classes for wrong values.
            raise InputError(
                f"parameter {self.name}: must be {self.allowed_text}: {error}"
            ) from error
        return self.checked(value)


LOAD = ParameterSpec(
    "load",
    [""],
    "Python files that register effects or steppers for scenes; they run with the node's rights",
    fixed=True,
)
"""Parameter of nodes that read scenes; ``Parameters`` loads the files."""


class Parameters:
    """Parameters of a node: declared from a table, and validated before they are changed.

    ROS ignores values for undeclared parameters; here they are refused.

    Parameters
    ----------
    node
        Node of the parameters.
    specs
        All parameters of the node.

    Raises
    ------
    InputError
        A value has another type or is not allowed, or a parameter does not exist; the message has
        the nearest name.
    """

    def __init__(self, node: BaseNode, specs: Iterable[ParameterSpec]) -> None:
        self._node = node
        self._specs = {spec.name: spec for spec in specs}
        self.values: Values = {name: spec.declare(node) for name, spec in self._specs.items()}
        """Present values, by name."""
        defaults = {name: spec.default for name, spec in self._specs.items()}
        node.parameter_defaults = {**node.parameter_defaults, **defaults}
        _refuse_undeclared(node)
        load_files(filter(None, self.values.get(LOAD.name, ())), f"parameter {LOAD.name} =")
        node.get_logger().info(f"{PARAMETERS}: {node.changed_parameters()}")

    def accept_changes(
        self, validate: Callable[[Values], None], apply: Callable[[Values, Values], None]
    ) -> None:
        """Accept changes from now on.

        Parameters
        ----------
        validate
            Function without side effects that raises an AbSimError if the new values are not
            allowed together; the values then remain unchanged.
        apply
            Function that is called with the old and the new values, after a change of ``values``.
        """

        def validated(parameters: list[Parameter[Any]]) -> SetParametersResult:
            try:
                validate(self._with(parameters))
            except AbSimError as error:
                return SetParametersResult(successful=False, reason=str(error))
            return SetParametersResult(successful=True)

        def applied(parameters: list[Parameter[Any]]) -> None:
            if {p.name for p in parameters} & self._specs.keys():
                before, self.values = self.values, self._with(parameters)
                apply(before, self.values)

        self._node.add_on_set_parameters_callback(validated)
        self._node.add_post_set_parameters_callback(applied)

    def _with(self, parameters: list[Parameter[Any]]) -> dict[str, Any]:
        """Return all values, with changes; ignore parameters that this object did not declare.

        Raises
        ------
        InputError
            A value has the wrong type or is not allowed, or a parameter is deleted.
        """
        for p in parameters:
            # ROS would forget the parameter, and reject its name from then on.
            if p.name in self._specs and p.type_ is Parameter.Type.NOT_SET:
                raise InputError(f"parameter {p.name}: cannot be deleted; set it instead")
        changes = {p.name: p.value for p in parameters if p.name in self._specs}
        checked = {name: self._specs[name].checked(value) for name, value in changes.items()}
        return {**self.values, **checked}


_QOS = "qos_overrides."
"""Prefix of the names of parameters that override a topic's quality of service."""
_QOS_POLICIES: dict[str, Sequence[str]] = {
    "reliability": ("reliable", "best_effort"),
    "history": ("keep_last", "keep_all"),
    "depth": (),  # a number
}
ALIKE = 0.8
"""Similarity above which an unknown parameter in a section for all nodes may be a misspelt one of
this node."""


def _refuse_undeclared(node: BaseNode) -> None:
    """Refuse values for undeclared parameters.

    Overrides of a topic's QoS are declared with the topic: only their form is checked here.
    """
    declared, shared, foreign = list(node.parameter_values()), _shared_parameters(sys.argv), []
    for name, parameter in node.handle.get_parameters(Parameter).items():
        if name.startswith(_QOS):
            _check_override(name, parameter.value)
        elif node.has_parameter(name):
            continue
        elif name in shared:
            suggestion = nearest(name, declared, ALIKE).removeprefix("; ")
            foreign.append(f"{name} ({suggestion})" if suggestion else name)
        else:
            raise InputError(
                f"parameter {name}: {node.get_fully_qualified_name()} has none of that name"
                f"{nearest(name, declared)}; it has {', '.join(declared)}; parameters of other "
                "nodes go into a parameter file, under the nodes' names"
            )
    if foreign:
        node.get_logger().warning(
            f"parameter {', '.join(sorted(foreign))}: ignored; it is in a section for all nodes, "
            f"and {node.get_fully_qualified_name()} has none of that name"
        )


def _shared_parameters(arguments: Sequence[str]) -> set[str]:
    """Return the parameters in sections for several nodes, such as `/**`, of parameter files.

    Parameters
    ----------
    arguments
        Command line that ROS has accepted.
    """
    parameter_names, names = set[str](), set[str]()
    for flag, value in itertools.pairwise(arguments):
        if flag == "-p":
            parameter_names.add(value.partition(":=")[0])
        elif flag == "--params-file":
            with contextlib.suppress(OSError, ValueError):  # ROS has accepted the file
                for section, content in read_yaml_file(Path(value)).items():
                    if section.endswith("*"):
                        names |= set(_flat(content["ros__parameters"]))
    return names - parameter_names


def _flat(parameters: Mapping[str, Any]) -> Iterator[str]:
    """Yield the names of parameters; as in ROS, those in nested sections contain dots."""
    for name, value in parameters.items():
        if isinstance(value, Mapping):
            yield from (f"{name}.{inner}" for inner in _flat(value))
        else:
            yield name


def whole_ratio(long: float, short: float, meaning: str) -> int:
    """Return the ratio ``long`` / ``short``, which must be an integer.

    Raises
    ------
    InputError
        The ratio is not an integer; the message begins with ``meaning``.
    """
    ratio = long / short
    if round(ratio) < 1 or abs(ratio - round(ratio)) > 1e-6 * ratio:
        raise InputError(
            f"{meaning}: {long:.10g} s must be a whole multiple of {short:.10g} s; "
            f"for example, use a rate of {1 / (max(round(ratio), 1) * short):g} 1/s"
        )
    return round(ratio)


def path_of(text: str) -> Path:
    """Return the path that a parameter contains, with ``~`` expanded."""
    return Path(os.path.expanduser(text))


def recording_file(path: str) -> Path:
    """Return the file of a recorder's parameter ``path``, and create its folder.

    Raises
    ------
    InputError
        The file is not an .rrd file, or cannot be written.
    """
    file, origin = path_of(path), "parameter path ="
    check_ending(file, RECORDING, origin)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"{origin} {file}: its folder cannot be created: {error.strerror}"
        ) from error
    check_writable(file, origin, replaced=False)
    return file


def recording_folder(path: str) -> Path:
    """Return the folder of a recorder's parameter ``bag``, and create its parents.

    Raises
    ------
    InputError
        The folder cannot be written, or a file has its name.
    """
    folder, origin = path_of(path), "parameter bag ="
    check_folder(folder, origin)
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"{origin} {folder}: its folder cannot be created: {error.strerror}"
        ) from error
    if not os.access(folder.parent, os.W_OK):
        raise InputError(f"{origin} {folder}: cannot be written; choose another place")
    return folder


def _check_override(name: str, value: Any) -> None:
    """Refuse an unknown QoS policy, which ROS would ignore, and an invalid value."""
    _, _, end_and_policy = name.removeprefix(_QOS).partition(".")
    end, _, policy = end_and_policy.partition(".")
    if end not in ("publisher", "subscription") or policy not in _QOS_POLICIES:
        raise InputError(
            f"parameter {name}: must be {_QOS}TOPIC.publisher or .subscription, with one of "
            + ", ".join(f".{policy}" for policy in _QOS_POLICIES)
        )
    if allowed := _QOS_POLICIES[policy]:
        if value not in allowed:
            raise InputError(f"parameter {name} = {short(value)}: must be {' or '.join(allowed)}")
    elif not isinstance(value, int) or isinstance(value, bool) or value < 1:
        raise InputError(f"parameter {name} = {short(value)}: must be a whole number from 1")


def _kind(default: Any) -> str:
    """Return the type of a parameter in words, for messages."""
    kinds = {bool: "true or false", int: "a whole number", float: "a number", str: "a text"}
    return kinds.get(type(default), "a list of texts, e.g. ['balls.mass=0.002']")


def _converted(value: Any, default: Any) -> Any:
    """Return a value converted to the default's type; None if that is impossible."""
    if isinstance(default, list):
        texts = [value] if isinstance(value, str) else [] if value is None else value
        alike = isinstance(texts, Iterable) and all(isinstance(text, str) for text in texts)
        return list(texts) if alike else None
    if isinstance(default, bool) or isinstance(value, bool):
        return value if type(value) is type(default) else None
    if isinstance(default, float) and isinstance(value, int):
        return float(value)
    if isinstance(default, int) and isinstance(value, float) and value.is_integer():
        return int(value)
    return value if type(value) is type(default) else None
