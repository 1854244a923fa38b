"""Parameters that change while a node runs: validated without side effects, then applied."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from ab_sim.errors import AbSimError, InputError
from ab_sim.nodes.parameters import ParameterSpec

Values = Mapping[str, Any]


class Settings:
    """The changeable parameters of a node.

    Args:
        node: node of the parameters.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._specs: dict[str, ParameterSpec] = {}
        self.values: dict[str, Any] = {}
        """Present values, by name."""
        self.explicitly_set: set[str] = set()
        """Names of parameters that were set, or started with a value other than the default."""

    def declare(self, meaning: str, spec: ParameterSpec) -> None:
        """Declare a parameter.

        Raises:
            InputError: the value has another type, or is not allowed.
        """
        self._specs[spec.name] = spec
        value = spec.declare(self._node, meaning, read_only=False)
        self.values[spec.name] = value
        if value != spec.default:
            self.explicitly_set.add(spec.name)

    def accept_changes(
        self, validate: Callable[[Values], None], apply: Callable[[Values, Values], None]
    ) -> None:
        """Accept changes from now on.

        Args:
            validate: raises an AbSimError if the new set of values is not allowed; it has no side
                effects, and the values are then left unchanged.
            apply: called with the old and the new values, after ``values`` has the new ones.
        """

        def validated(parameters: list[Parameter[Any]]) -> SetParametersResult:
            try:
                validate(self._with(parameters))
            except AbSimError as error:
                return SetParametersResult(successful=False, reason=str(error))
            return SetParametersResult(successful=True)

        def applied(parameters: list[Parameter[Any]]) -> None:
            if names := {p.name for p in parameters} & self._specs.keys():
                self.explicitly_set |= names
                before, self.values = self.values, self._with(parameters)
                apply(before, self.values)

        self._node.add_on_set_parameters_callback(validated)
        self._node.add_post_set_parameters_callback(applied)

    def _with(self, parameters: list[Parameter[Any]]) -> dict[str, Any]:
        """Return all values with some changed; parameters declared elsewhere are ignored.

        Raises:
            InputError: a value has the wrong type or is not allowed, or a parameter is deleted.
        """
        for p in parameters:
            # ROS would forget the parameter, and reject its name from then on.
            if p.name in self._specs and p.type_ is Parameter.Type.NOT_SET:
                raise InputError(f"parameter {p.name}: cannot be deleted; set it instead")
        changes = {p.name: p.value for p in parameters if p.name in self._specs}
        checked = {name: self._specs[name].checked(value) for name, value in changes.items()}
        return {**self.values, **checked}
