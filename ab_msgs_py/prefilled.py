"""Messages that are published again and again with other numbers, as bytes.

Making a message object and serialising it costs several times what sending it does. Where all but
the stamp and the numbers stays as it is, these are written over the last ones.
"""

import struct
from collections.abc import Callable, Mapping, Sequence
from typing import Any

_HEAD = b"\x00\x01\x00\x00"
"""Plain CDR (XCDR1), little-endian."""
_TIME = "builtin_interfaces/Time"
_STAMP = struct.Struct("<iI")
_INTEGERS = {"int32": struct.Struct("<i"), "uint32": struct.Struct("<I")}


class Prefilled:
    """A message in CDR, in which only stamps and floating-point numbers change.

    Args:
        message: says all the rest: texts, and how many numbers there are.
        changing: which of its numbers change, in the order of its fields; default: all.
        fields_of: names and types of a message's fields; default: as ROS's own messages say them.

    Raises:
        ValueError: it has fields of other kinds than numbers of 4 or 8 bytes and texts.
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
        """What to publish.

        Args:
            time: of all its stamps [ns].
            numbers: all that change, in the order of the message's fields.
        """
        sec, nanosec = divmod(time, 10**9)
        for place in self._stamps:
            _STAMP.pack_into(self._bytes, place, sec, nanosec)
        for place, pack_into, part in self._runs:
            pack_into(self._bytes, place, *numbers[part])
        return bytes(self._bytes)

    def _write(self, value: Any, kind: str) -> None:
        """Serialise a field; alignment counts from behind the head, and gaps are zero."""
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
            for each in value:
                self._write(each, kind[len("sequence<") : -1])
        elif kind.endswith("]"):
            for each in value:
                self._write(each, kind[: kind.index("[")])
        elif "/" in kind or not kind:
            for name, own in self._fields_of(value).items():
                self._write(getattr(value, name), own)
        else:
            raise ValueError(f"a field of type {kind} cannot be prefilled")

    def _room(self, alignment: int, content: bytes) -> int:
        """Where the content has been put."""
        self._bytes += bytes(-(len(self._bytes) - len(_HEAD)) % alignment)
        place = len(self._bytes)
        self._bytes += content
        return place


def _runs(places: Sequence[int]) -> list[tuple[int, int, int]]:
    """Numbers that lie side by side: where the first is, which it is, and how many there are."""
    runs: list[tuple[int, int, int]] = []
    for index, place in enumerate(places):
        if runs and place == runs[-1][0] + 8 * runs[-1][2]:
            runs[-1] = (runs[-1][0], runs[-1][1], runs[-1][2] + 1)
        else:
            runs.append((place, index, 1))
    return runs
