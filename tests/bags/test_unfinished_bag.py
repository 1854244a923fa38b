"""Where the whole records of an unfinished MCAP file end."""

import struct
from pathlib import Path

import pytest

from ab_sim.record.bags.unfinished_bag import END, MAGIC, CompletedFile, is_finished, torn_bytes


def record(kind: int, content: bytes) -> bytes:
    return struct.pack("<BQ", kind, len(content)) + content


HEADER, MESSAGE, EMPTY = record(1, b"\0" * 8), record(5, b"12345678"), record(5, b"")


@pytest.mark.parametrize("whole", [b"", HEADER, HEADER + MESSAGE, HEADER + EMPTY])
@pytest.mark.parametrize("torn", [b"", MESSAGE[:1], MESSAGE[:8], MESSAGE[:9], MESSAGE[:-1]])
def test_a_record_that_ends_where_the_file_does_is_whole(
    tmp_path: Path, whole: bytes, torn: bytes
) -> None:
    file = tmp_path / "bag.mcap"
    file.write_bytes(MAGIC + whole + torn)
    assert torn_bytes(file) == len(torn) and not is_finished(file)
    with CompletedFile(file).open("rb") as completed:
        assert completed.read() == MAGIC + whole + END
