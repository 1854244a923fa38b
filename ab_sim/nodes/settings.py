"""Parameters that change while a node runs: judged without side effects, then applied together."""

from collections.abc import Callable, Mapping
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from ab_sim.errors import AbSimError, InputError
from ab_sim.nodes.parameters import Wanted

Values = Mapping[str, Any]


class Settings:
    """The changeable parameters of a node.

    Args:
        node: theirs.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._wanted: dict[str, Wanted] = {}
        self.values: dict[str, Any] = {}
        """What holds, by name."""
        self.asked: set[str] = set()
        """Names of those that somebody has set, or that began as no default."""

    def declare(self, meaning: str, wanted: Wanted) -> None:
        """One more.

        Raises:
            InputError: the value given is of another type, or is not allowed.
        """
        self._wanted[wanted.name] = wanted
        value = wanted.declare(self._node, meaning, read_only=False)
        self.values[wanted.name] = value
        if value != wanted.default:
            self.asked.add(wanted.name)

    def follow(
        self, judge: Callable[[Values], None], apply: Callable[[Values, Values], None]
    ) -> None:
        """Let them be changed from now on.

        Args:
            judge: raises an error of ab_sim, and does nothing else, if all values as they would be
                may not be; they then stay as they are.
            apply: is given the values that held and, after ``values`` has them, those that hold.
        """

        def judged(parameters: list[Parameter[Any]]) -> SetParametersResult:
            try:
                judge(self._with(parameters))
            except AbSimError as error:
                return SetParametersResult(successful=False, reason=str(error))
            return SetParametersResult(successful=True)

        def applied(parameters: list[Parameter[Any]]) -> None:
            if names := {p.name for p in parameters} & self._wanted.keys():
                self.asked |= names
                before, self.values = self.values, self._with(parameters)
                apply(before, self.values)

        self._node.add_on_set_parameters_callback(judged)
        self._node.add_post_set_parameters_callback(applied)

    def _with(self, parameters: list[Parameter[Any]]) -> dict[str, Any]:
        """All values as they would be; parameters of others are not looked at.

        Raises:
            InputError: one of them is of another type, or is not allowed; or is to be deleted.
        """
        for p in parameters:
            # ROS would forget it, and know no parameter of that name from then on.
            if p.name in self._wanted and p.type_ is Parameter.Type.NOT_SET:
                raise InputError(f"parameter {p.name}: cannot be deleted; set it instead")
        changes = {p.name: p.value for p in parameters if p.name in self._wanted}
        checked = {name: self._wanted[name].checked(value) for name, value in changes.items()}
        return {**self.values, **checked}
