"""ROS messages from plain fields, and the error of invalid ones; ROS is imported on first use."""

import array
import importlib
from functools import lru_cache
from typing import Any

import numpy as np


class MalformedMessage(ValueError):
    """Message without the layout of the contract; the text names the part and what is expected."""


Fields = dict[str, Any]
"""All fields of a message by name; fields of nested messages are dictionaries, too."""


@lru_cache(maxsize=64)
def class_of(type_name: str) -> Any:
    """Return the class of a message type such as ``std_msgs/msg/Float64``.

    ROS's names of nested types, without ``msg``, are accepted, too.

    Raises
    ------
    ImportError
        The package or the message is not installed.
    """
    package, *_, name = type_name.split("/")
    module = importlib.import_module(f"{package}.msg")
    try:
        return getattr(module, name)
    except AttributeError as error:
        raise ImportError(f"{package} has no {name}") from error


def filled(message: Any, fields: Fields) -> Any:
    """Set fields of a message and return the message."""
    for name, value in fields.items():
        if isinstance(value, dict):
            filled(getattr(message, name), value)
            continue
        if isinstance(value, np.ndarray):
            # Setting an array is 20 times as fast as setting a list.
            value = array.array("d", value.tobytes())
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            kind = message.get_fields_and_field_types()[name]
            element = class_of(kind.removeprefix("sequence<").rstrip(">"))
            value = [filled(element(), element_value) for element_value in value]
        setattr(message, name, value)
    return message
