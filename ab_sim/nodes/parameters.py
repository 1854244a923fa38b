"""Parameters with descriptors: meaning, unit, range, and whether they may change later."""

from pathlib import Path
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node

from ab_sim.errors import InputError


def declare(
    node: Node,
    name: str,
    default: Any,
    meaning: str,
    unit: str = "",
    allowed: tuple[float, float] | None = None,
) -> Any:
    """Declare a read-only parameter and return its value.

    Args:
        node: its node.
        name: its name.
        default: used when nothing else is given; its type is the parameter's.
        meaning: one line for people.
        unit: SI unit.
        allowed: least and greatest value.

    Raises:
        InputError: the value given is of another type or out of range.
    """
    descriptor = ParameterDescriptor(
        description=meaning + (f" [{unit}]" if unit else ""),
        read_only=True,
    )
    if allowed is not None:
        low, high = allowed
        if isinstance(default, int):
            descriptor.integer_range = [IntegerRange(from_value=int(low), to_value=int(high))]
        else:
            descriptor.floating_point_range = [FloatingPointRange(from_value=low, to_value=high)]
    try:
        return node.declare_parameter(name, default, descriptor).value
    except Exception as error:
        # rclpy raises a different class for every way in which a value can be wrong.
        within = f", from {allowed[0]:g} to {allowed[1]:g}" if allowed else ""
        raise InputError(
            f"parameter {name}: must be of type {type(default).__name__}{within}"
            f"{' ' + unit if unit else ''}: {error}"
        ) from error


def whole_ratio(long: float, short: float, meaning: str) -> int:
    """How often ``short`` goes into ``long``, which must be a whole number of times.

    Raises:
        InputError: it is not; names both.
    """
    ratio = long / short
    if round(ratio) < 1 or abs(ratio - round(ratio)) > 1e-6 * ratio:
        raise InputError(f"{meaning}: {long:g} s must be a whole number of times {short:g} s")
    return round(ratio)


def output_file(path: str) -> Path:
    """A file to write to, its folder made.

    Raises:
        InputError: the folder cannot be made.
    """
    file = Path(path).expanduser()
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{file}: its folder cannot be made: {error.strerror}") from error
    return file
