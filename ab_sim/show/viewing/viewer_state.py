"""State of the web viewer from Rerun 0.41's page: amount of data of each recording."""

from collections.abc import Iterator

TIMELINE = b"sim_time"


def newest_times(state: bytes) -> dict[str, float]:
    """Return the newest time [s] that the viewer has of each recording, by the recording's id.

    Args:
        state: ``GetStateResponse`` of Rerun's viewer control, in protobuf's wire format.

    Raises:
        ValueError: the state has another form.
    """
    times = {}
    for recording in _bytes(state, 3):
        name = b"".join(_bytes(recording, 1)).decode(errors="replace")
        for timeline in _bytes(recording, 2):
            if TIMELINE in timeline:
                ends = [end for span in _bytes(timeline, 3) for end in _numbers(span, 2)]
                times[name.rpartition(":")[2]] = 1e-9 * max(ends, default=0)
    return times


def _bytes(message: bytes, number: int) -> Iterator[bytes]:
    return (value for value in _fields(message, number) if isinstance(value, bytes))


def _numbers(message: bytes, number: int) -> Iterator[int]:
    return (value for value in _fields(message, number) if isinstance(value, int))


def _fields(message: bytes, number: int) -> Iterator[int | bytes]:
    """Yield the values of a field of a protobuf message: integers, or bytes with a length."""
    at = 0

    def varint() -> int:
        nonlocal at
        value = shift = 0
        while True:
            if at >= len(message) or shift > 63:
                raise ValueError("no protobuf message")
            byte, at = message[at], at + 1
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value

    while at < len(message):
        key = varint()
        value: int | bytes
        if (kind := key & 7) == 0:
            value = varint()
        elif kind in (1, 2, 5):
            size = varint() if kind == 2 else 8 if kind == 1 else 4
            value, at = message[at : at + size], at + size
        else:
            raise ValueError("no protobuf message")
        if key >> 3 == number:
            yield value
