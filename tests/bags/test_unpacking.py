"""Small bags that unpack to much more: refused, and not unpacked first."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from ab_msgs_py.topics import BLOCK
from ab_sim.base.errors import RecordingError
from ab_sim.record.bags.contract import TYPES
from ab_sim.record.bags.reader import MOST_CHUNK, Bag
from ab_sim.record.bags.repair import repair_bag

MODES = {
    CompressionMode.STORAGE: r"chunk unpacks to \d+ bytes; .* 67108864",
    CompressionMode.MESSAGE: "message unpacks .* 67108864 bytes",
    CompressionMode.FILE: r"file unpacks .* \d+ bytes",
}


def bag_of_zeros(path: Path, mode: CompressionMode, size: int) -> Path:
    bag = Writer(path, version=9, storage_plugin=StoragePlugin.MCAP)
    bag.set_compression(mode, CompressionFormat.ZSTD)
    with bag:
        topic = bag.add_connection("/vibration/block", BLOCK.type_name, typestore=TYPES)
        bag.write(topic, 0, bytes(size))
    assert sum(file.stat().st_size for file in path.iterdir()) < 50_000
    return path


@pytest.mark.parametrize("mode", MODES)
def test_a_small_bag_of_many_zeros_is_refused(mode: CompressionMode, tmp_path: Path) -> None:
    path = bag_of_zeros(tmp_path / "bag", mode, 2 * MOST_CHUNK)
    with pytest.raises(RecordingError, match=MODES[mode]), Bag(path) as bag:
        list(bag.messages(bag.topics))


@pytest.mark.parametrize("mode", MODES)
def test_a_sound_bag_of_zeros_is_read(mode: CompressionMode, tmp_path: Path) -> None:
    with Bag(bag_of_zeros(tmp_path / "bag", mode, MOST_CHUNK // 2)) as bag:
        (message,) = bag.messages(bag.topics)
    assert message.data == bytes(MOST_CHUNK // 2)


def test_a_chunk_unpacks_to_no_more_than_it_states(tmp_path: Path) -> None:
    path = bag_of_zeros(tmp_path / "bag", CompressionMode.STORAGE, MOST_CHUNK // 2)
    (file,) = path.glob("*.mcap")
    content = file.read_bytes()
    at = content.index(b"\x04\x00\x00\x00zstd") - 12
    stated = content[at : at + 8]
    assert int.from_bytes(stated, "little") > MOST_CHUNK // 2
    file.write_bytes(content.replace(stated, (4096).to_bytes(8, "little")))
    with pytest.raises(RecordingError, match="than the 4096 bytes"), Bag(path) as bag:
        list(bag.messages(bag.topics))


def test_repairing_unpacks_no_more(tmp_path: Path) -> None:
    path = bag_of_zeros(tmp_path / "bag", CompressionMode.STORAGE, 2 * MOST_CHUNK)
    (file,) = path.glob("*.mcap")
    torn = tmp_path / file.name
    shutil.copy(file, torn)
    torn.write_bytes(torn.read_bytes()[:-40])
    with pytest.raises(RecordingError, match="at most 67108864"):
        repair_bag(torn)
    assert [each.name for each in tmp_path.iterdir() if each.name.startswith(".")] == []
