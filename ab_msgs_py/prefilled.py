"""Serialised messages that are published repeatedly with different numbers.

Creating and serialising a message object costs several times as much as sending it. If only the
stamp and the numbers change, they are written over those of the last message.
"""

import struct
from collections.abc import Callable, Mapping, Sequence
from typing import Any

_HEAD = b"\x00\x01\x00\x00"
"""Header of plain CDR (XCDR1), little-endian."""
_TIME = "builtin_interfaces/Time"
_STAMP = struct.Struct("<iI")
_INTEGERS = {"int32": struct.Struct("<i"), "uint32": struct.Struct("<I")}


class Prefilled:
    """Message in CDR in which only stamps and floating-point numbers change.

    Parameters
    ----------
    message
        Message with the constant parts: texts, and lengths of lists.
    changing
        Positions of the numbers that change, in the order of the message's fields; default: all.
    fields_of
        Function that returns names and types of a message's fields; default: the method of ROS
        messages.

    Raises
    ------
    ValueError
        The message has fields other than texts and numbers of 4 or 8 bytes.
    """

    def __init__(
        self,
        message: Any,
        changing: slice = slice(None),
        fields_of: Callable[[Any], Mapping[str, str]] = lambda m: m.get_fields_and_field_types(),
    ) -> None:
        self._fields_of = fields_of
        self._bytes = bytearray(_HEAD)
        self._stamps: list[int] = []
        self._numbers: list[int] = []
        self._write(message, "")
        self._runs = [
            (place, struct.Struct(f"<{count}d").pack_into, slice(first, first + count))
            for place, first, count in _runs(self._numbers[changing])
        ]

    def at(self, time: int, numbers: Sequence[float]) -> bytes:
        """Return the serialised message.

        Parameters
        ----------
        time
            Value of all stamps [ns].
        numbers
            All numbers that change, in the order of the message's fields.
        """
        sec, nanosec = divmod(time, 10**9)
        for place in self._stamps:
            _STAMP.pack_into(self._bytes, place, sec, nanosec)
        for place, pack_into, part in self._runs:
            pack_into(self._bytes, place, *numbers[part])
        return bytes(self._bytes)

    def _write(self, value: Any, kind: str) -> None:
        """Serialise a field of a type in ROS notation; an empty ``kind`` is the whole message.

        By the rules of CDR, alignment counts from the end of the header. Gaps are zero.
        """
        if kind == _TIME:
            self._stamps.append(self._room(4, _STAMP.pack(value.sec, value.nanosec)))
        elif kind == "double":
            self._numbers.append(self._room(8, struct.pack("<d", value)))
        elif kind in _INTEGERS:
            self._room(4, _INTEGERS[kind].pack(value))
        elif kind == "string":
            text = value.encode() + b"\0"
            self._room(4, struct.pack("<I", len(text)) + text)
        elif kind.startswith("sequence<"):
            self._room(4, struct.pack("<I", len(value)))
            for element in value:
                self._write(element, kind[len("sequence<") : -1])
        elif kind.endswith("]"):
            for element in value:
                self._write(element, kind[: kind.index("[")])
        elif "/" in kind or not kind:
            for name, field in self._fields_of(value).items():
                self._write(getattr(value, name), field)
        else:
            raise ValueError(f"a field of type {kind} cannot be prefilled")

    def _room(self, alignment: int, content: bytes) -> int:
        """Append padding up to the alignment and then ``content``; return the content's offset."""
        self._bytes += bytes(-(len(self._bytes) - len(_HEAD)) % alignment)
        place = len(self._bytes)
        self._bytes += content
        return place


def _runs(places: Sequence[int]) -> list[tuple[int, int, int]]:
    """Return runs of adjacent numbers as (offset, index of the first number, count)."""
    runs: list[tuple[int, int, int]] = []
    for index, place in enumerate(places):
        if runs and place == runs[-1][0] + 8 * runs[-1][2]:
            runs[-1] = (runs[-1][0], runs[-1][1], runs[-1][2] + 1)
        else:
            runs.append((place, index, 1))
    return runs
