"""The IDL file of the prototype in C has the fields of ROS's messages, in their order."""

import re
from importlib import import_module

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2")

from tests.examples.prototype import FOLDER  # noqa: E402

STRUCT = re.compile(r"struct (\w+)_ \{(.*?)\}", re.DOTALL)
MODULE = re.compile(r"^module (\w+) ", re.MULTILINE)
PLAIN = {"int32": "long", "uint32": "unsigned long"}


def in_idl(kind: str) -> str:
    """A field's type as rclpy names it, in IDL: ``sequence<double>``, ``std_msgs/Header``."""
    if "/" in kind:
        package, name = kind.split("/")
        return f"{package}::msg::dds_::{name}_"
    return PLAIN.get(kind, kind)


def test_fields_are_those_of_ros() -> None:
    text = (FOLDER / "c" / "messages.idl").read_text()
    names, bodies = MODULE.findall(text), MODULE.split(text)[2::2]
    seen = set()
    for package, body in zip(names, bodies, strict=True):
        for name, fields in STRUCT.findall(body):
            message = getattr(import_module(f"{package}.msg"), name)
            written = [tuple(line.strip().rsplit(" ", 1)) for line in fields.split(";")[:-1]]
            # Structs of the same package may be named alone.
            full = [
                (
                    f"{package}::msg::dds_::{kind}"
                    if kind.endswith("_") and "::" not in kind
                    else kind,
                    field,
                )
                for kind, field in written
            ]
            declared = message.get_fields_and_field_types().items()
            assert full == [(in_idl(kind), f"{field}_") for field, kind in declared], name
            seen.add(name)
    assert {"Float64", "JointState", "AccelStamped"} <= seen
