"""Parser of protobuf messages that needs no schema."""

from typing import Any

_SIZES = {1: 8, 5: 4}  # sizes of numbers of fixed size [bytes], by kind of field


def fields_of(message: bytes) -> dict[int, list[Any]]:
    """Return the values of each field of a message, integers or bytes, by the field's number.

    Raises
    ------
    ValueError
        The message is damaged.
    """
    fields: dict[int, list[Any]] = {}
    at = 0

    def varint() -> int:
        nonlocal at
        value = 0
        for shift in range(0, 64, 7):
            if at >= len(message):
                break
            byte, at = message[at], at + 1
            value |= (byte & 0x7F) << shift
            if byte < 0x80:
                return value
        raise ValueError("not a protobuf message")

    while at < len(message):
        key = varint()
        kind = key & 7
        if kind == 0:
            value: int | bytes = varint()
        else:
            size = varint() if kind == 2 else _SIZES.get(kind, len(message))
            if at + size > len(message):
                raise ValueError("not a protobuf message")
            value, at = message[at : at + size], at + size
        fields.setdefault(key >> 3, []).append(value)
    return fields
