"""Messages of the contract in CDR without ROS: rosbags' in the place of ROS's own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

from ab_msgs_py import Topic
from ab_msgs_py.prefilled import Prefilled

TYPES = get_typestore(Stores.ROS2_KILTED)
"""ROS 2's standard messages; those that the contract uses are the same in Jazzy."""

_SPELLED = {"float64": "double", "float32": "float", "bool": "boolean", "byte": "octet"}
"""Types of numbers as ROS's own messages name them, where rosbags names them otherwise."""


def encoded(topic: Topic, sample: Any) -> bytes:
    """A sample as the topic's message, in CDR."""
    message = _made(topic.type_name, topic.conversion.fields(sample))
    return bytes(TYPES.serialize_cdr(message, topic.type_name))


def prefilled(topic: Topic, sample: Any) -> Prefilled:
    """Messages of a topic that are like this sample's but for stamps and numbers."""
    message = _made(topic.type_name, topic.conversion.fields(sample))
    return Prefilled(message, fields_of=_fields_of)


def decoded(message: bytes, type_name: str) -> Any:
    """The message that is in CDR.

    Raises:
        ValueError: it is none of that type.
    """
    try:
        return TYPES.deserialize_cdr(message, type_name)
    except Exception as error:  # rosbags raises whatever it stumbles over
        raise ValueError(f"not a {type_name}: {error}") from error


def _made(type_name: str, fields: Mapping[str, Any]) -> Any:
    kinds = dict(TYPES.get_msgdef(type_name).fields)
    return TYPES.types[type_name](**{key: _value(kinds[key], fields[key]) for key in kinds})


def _value(kind: Any, value: Any) -> Any:
    node, inner = kind
    if node is Nodetype.NAME:
        return _made(inner, value)
    if node is Nodetype.BASE:
        return value[0] if isinstance(value, bytes) else value  # ROS has a byte as bytes
    if inner[0][0] is Nodetype.BASE and inner[0][1][0] != "string":
        return np.asarray(value, dtype=inner[0][1][0])
    return [_value(inner[0], each) for each in value]


def _fields_of(message: Any) -> dict[str, str]:
    """Fields and their types, as ROS's own messages say them."""
    return {name: _spelled(kind) for name, kind in TYPES.get_msgdef(message.__msgtype__).fields}


def _spelled(kind: Any) -> str:
    node, inner = kind
    if node is Nodetype.NAME:
        return str(inner).replace("/msg/", "/")
    if node is Nodetype.BASE:
        return _SPELLED.get(inner[0], str(inner[0]))
    each = _spelled(inner[0])
    return f"sequence<{each}>" if node is Nodetype.SEQUENCE else f"{each}[{inner[1]}]"
