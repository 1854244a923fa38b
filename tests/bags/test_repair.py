"""A killed writer's bag, read by others as it is, and repaired."""

from __future__ import annotations

import io
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from ab_msgs_py.topics import BLOCK, DESCRIPTION
from ab_sim.base.errors import RecordingError
from ab_sim.record.bags.contract import encoded, offered_qos
from ab_sim.record.bags.importing import import_bag
from ab_sim.record.bags.reader import Bag
from ab_sim.record.bags.repair import repair_bag
from ab_sim.record.bags.writer import BagWriter
from tests.bags.made import bag_of, block_of
from tests.cli.tool import ab_sim
from tests.recorded import read_recording
from tests.recording.runs import describe, run
from tests.recording.test_errors import files_limited_to

CHANNELS, SAMPLES = run(600)
FLUSHES = 30
KILLED = """
import os, signal, sys
sys.path[:0] = {path!r}
from tests.bags.test_repair import write
write({bag!r})
os.kill(os.getpid(), signal.SIGKILL)
"""
"""A process that writes a bag, and is killed after its last flush."""


def write(path: Path | str) -> BagWriter:
    """Blocks of 10 rows, two in each flush; it is never closed."""
    bag = BagWriter(path)
    bag.topic("/drive_description", DESCRIPTION.type_name, offered_qos(DESCRIPTION.qos))
    bag.topic("/vibration/block", BLOCK.type_name, offered_qos(BLOCK.qos))
    bag.write("/drive_description", 0, encoded(DESCRIPTION, describe()))
    for first in range(0, 600, 10):
        block = block_of(CHANNELS, SAMPLES[first : first + 10])
        bag.write("/vibration/block", (first + 10) * 10**6, block)
        if first % 20:
            bag.flush()
    return bag


@pytest.fixture(scope="module")
def left(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The bag that such a process leaves."""
    bag = tmp_path_factory.mktemp("killed") / "bag"
    code = KILLED.format(path=sys.path, bag=str(bag))
    done = subprocess.run([sys.executable, "-c", code], cwd=Path(__file__).parents[2], check=False)
    assert done.returncode == -9
    return bag


@pytest.fixture
def killed(left: Path, tmp_path: Path) -> Path:
    """A copy of it."""
    return Path(shutil.copytree(left, tmp_path / "bag"))


def file_in(bag: Path) -> Path:
    (file,) = bag.glob("*.mcap")
    return file


def tear(bag: Path, lost: int) -> None:
    """As if it had been killed in the middle of writing."""
    content = file_in(bag).read_bytes()
    file_in(bag).write_bytes(content[:-lost])


def by_mcap(bag: Path) -> list[bytes]:
    """Blocks as the MCAP project's own library reads them."""
    with file_in(bag).open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        found = [m for _, _, m, _ in reader.iter_decoded_messages(topics=["/vibration/block"])]
    return [message.data for message in found]


def by_rosbags(bag: Path) -> list[bytes]:
    """Blocks as rosbags reads a bag's folder."""
    with Reader(bag) as reader:
        wanted = [c for c in reader.connections if c.topic == "/vibration/block"]
        found = [bytes(data) for _, _, data in reader.messages(wanted)]
    store = get_typestore(Stores.ROS2_KILTED)
    with AnyReader([bag], default_typestore=store) as many:
        assert len(list(many.messages())) == len(found) + 1
    return found


def written() -> list[bytes]:
    return [block_of(CHANNELS, SAMPLES[a : a + 10]) for a in range(0, 600, 10)]


def test_others_read_all_that_a_killed_writer_had_flushed(killed: Path) -> None:
    assert by_mcap(killed) == by_rosbags(killed) == written()
    with Bag(killed) as bag:
        assert not bag.complete and bag.topics["/vibration/block"].messages == 60
    assert file_in(killed).name == "bag_0.mcap", "as `ros2 bag reindex` asks for"


@pytest.mark.parametrize("lost", [0, 1, 40, 60, 500, 3000])
def test_a_torn_one_is_repaired_up_to_its_last_whole_chunk(killed: Path, lost: int) -> None:
    if lost:
        tear(killed, lost)
    with Bag(killed) as bag:
        there = list(bag.messages(bag.topics))
    repaired = repair_bag(killed)
    assert repaired is not None and repaired.messages == len(there) and (repaired.lost < 4000)
    blocks = written()[: len(there) - 1]
    assert len(blocks) >= 60 - 2 * (1 + lost // 500)
    assert by_mcap(killed) == by_rosbags(killed) == blocks
    with file_in(killed).open("rb") as file:
        summary = make_reader(file).get_summary()
        assert summary is not None and summary.statistics is not None
        assert summary.statistics.message_count == len(there) and summary.chunk_indexes
    with Bag(killed) as bag:
        assert bag.complete and list(bag.messages(bag.topics)) == there
    with Reader(killed) as reader:
        assert reader.message_count == len(there)
    assert sorted(p.name for p in killed.iterdir()) == ["bag_0.mcap", "metadata.yaml"]
    assert repair_bag(killed) is None, "nothing is left to repair"
    made = import_bag(killed, killed.parent / "back.rrd")
    back = read_recording(killed.parent / "back.rrd")
    assert made.complete and back.samples.tobytes() == SAMPLES[: 10 * len(blocks)].tobytes()


def test_the_file_alone_is_repaired_and_gets_no_metadata(killed: Path, tmp_path: Path) -> None:
    tear(killed, 60)
    (tmp_path / "alone").mkdir()
    file = Path(shutil.move(file_in(killed), tmp_path / "alone" / "other.mcap"))
    repaired = repair_bag(file)
    assert repaired is not None and [p.name for p in file.parent.iterdir()] == ["other.mcap"]
    with Bag(file) as bag:
        assert bag.complete and bag.count == repaired.messages


def test_one_that_is_still_written_is_refused(tmp_path: Path) -> None:
    writer = write(tmp_path / "bag")
    before = file_in(tmp_path / "bag").read_bytes()
    with pytest.raises(RecordingError, match="bag: .*still being written"):
        repair_bag(tmp_path / "bag")
    assert file_in(tmp_path / "bag").read_bytes() == before
    writer.close()
    assert repair_bag(tmp_path / "bag") is None


def test_a_writer_that_takes_no_lock_is_seen_too(killed: Path) -> None:
    with (
        file_in(killed).open("r+b"),
        pytest.raises(RecordingError, match="still being written"),
    ):
        repair_bag(killed)


def test_what_cannot_be_repaired_stays_as_it_was(killed: Path, tmp_path: Path) -> None:
    tear(killed, 60)
    file = file_in(killed)
    content = file.read_bytes()
    file.write_bytes(content.replace(b"rosbags-", b"libmcap-", 1))
    with pytest.raises(RecordingError, match=r"written by 'libmcap-.*`mcap recover`"):
        repair_bag(killed)
    assert file.read_bytes() == content.replace(b"rosbags-", b"libmcap-", 1)
    file.write_bytes(content)
    with files_limited_to(2000), pytest.raises(RecordingError, match="File too large"):
        repair_bag(killed)
    assert file.read_bytes() == content and len(list(killed.iterdir())) == 2
    for none, reason in (
        (tmp_path / "no", "no such file"),
        (tmp_path, "a folder with one"),
    ):
        with pytest.raises(RecordingError, match=reason):
            repair_bag(none)


def test_the_command_says_what_it_did(killed: Path) -> None:
    tear(killed, 500)
    first, second = (ab_sim("repair", "bag", cwd=killed.parent) for _ in range(2))
    assert first.returncode == second.returncode == 0
    assert "59 messages; " in first.stdout and "bytes of an incomplete message" in first.stdout
    assert "wrote bag" in first.stderr
    assert "bag is complete: " in second.stdout


def test_chunks_are_closed_at_every_flush_and_at_a_size(tmp_path: Path) -> None:
    writer = write(tmp_path / "flushed")
    writer.close()
    assert chunks(tmp_path / "flushed") == FLUSHES
    noise = [("/whirl", at, bytes(100_000)) for at in range(25)]
    assert chunks(bag_of(tmp_path / "large", noise)) == 3, "one for each megabyte, and the rest"


def chunks(bag: Path) -> int:
    records = StreamReader(io.BytesIO(file_in(bag).read_bytes()), emit_chunks=True).records
    return sum(type(record).__name__ == "Chunk" for record in records)


def test_a_type_that_nobody_knows_is_named(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag") as bag, pytest.raises(RecordingError) as refused:
        bag.topic("/a", "foo_msgs/msg/Bar", None)
    assert str(refused.value) == "/a: cannot be written: unknown type foo_msgs/msg/Bar"


def test_what_a_killed_repair_has_left_is_removed(killed: Path) -> None:
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    left, of_another = killed / f".repairing-{gone.pid}-abc", killed / ".repairing-1-abc"
    for room in (left, of_another):
        (room / "bag").mkdir(parents=True)
    assert repair_bag(killed) is not None
    assert not left.exists() and of_another.exists()
