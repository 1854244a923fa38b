"""Conversion between samples and serialised ROS messages (CDR), with rosbags instead of ROS."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore

from ab_msgs_py import Topic, topics
from ab_msgs_py.prefilled import Prefilled

TYPES = get_typestore(Stores.ROS2_KILTED)
"""ROS 2's standard messages; those of the contract are the same in Jazzy."""

_ROS_TYPE_NAMES = {"float64": "double", "float32": "float", "bool": "boolean", "byte": "octet"}
"""Names of numeric types in ROS, for those that have another name in rosbags."""


def encoded(topic: Topic, sample: Any) -> bytes:
    """Return a sample as a serialised message (CDR) of its topic."""
    message = _message_of(topic.type_name, topic.conversion.fields(sample))
    return bytes(TYPES.serialize_cdr(message, topic.type_name))


def prefilled(topic: Topic, sample: Any) -> Prefilled:
    """Return a message template from a sample, in which only stamp and numbers change."""
    message = _message_of(topic.type_name, topic.conversion.fields(sample))
    return Prefilled(message, fields_of=_fields_of)


def decoded(message: bytes, type_name: str) -> Any:
    """Return the message that CDR bytes contain.

    Raises:
        ValueError: the bytes are not a message of that type.
    """
    try:
        try:
            return TYPES.deserialize_cdr(message, type_name)
        except SerdeError:
            if type_name != topics.JOINT_COMMAND.type_name:
                raise
            # ROS appends 12 bytes if the last field is an empty list.
            return TYPES.deserialize_cdr(message[:-12], type_name)
    except Exception as error:  # rosbags raises various errors
        raise ValueError(f"not a {type_name}: {error}") from error


def _message_of(type_name: str, fields: Mapping[str, Any]) -> Any:
    kinds = dict(TYPES.get_msgdef(type_name).fields)
    return TYPES.types[type_name](**{key: _value(kinds[key], fields[key]) for key in kinds})


def _value(kind: Any, value: Any) -> Any:
    node, inner = kind
    if node is Nodetype.NAME:
        return _message_of(inner, value)
    if node is Nodetype.BASE:
        return value[0] if isinstance(value, bytes) else value  # ROS stores a byte as bytes
    if inner[0][0] is Nodetype.BASE and inner[0][1][0] != "string":
        return np.asarray(value, dtype=inner[0][1][0])
    return [_value(inner[0], element) for element in value]


def _fields_of(message: Any) -> dict[str, str]:
    """Return names and types of a message's fields, in the notation of ROS's message classes."""
    return {
        name: _ros_type_name(kind) for name, kind in TYPES.get_msgdef(message.__msgtype__).fields
    }


def _ros_type_name(kind: Any) -> str:
    node, inner = kind
    if node is Nodetype.NAME:
        return str(inner).replace("/msg/", "/")
    if node is Nodetype.BASE:
        return _ROS_TYPE_NAMES.get(inner[0], str(inner[0]))
    element = _ros_type_name(inner[0])
    return f"sequence<{element}>" if node is Nodetype.SEQUENCE else f"{element}[{inner[1]}]"
