"""Bags for tests, and recordings to export to bags."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from ab_msgs_py import Block, topics
from ab_sim.record.bags.contract import encoded, offered_qos, topic_by_name
from ab_sim.record.bags.exporting import export_bag
from ab_sim.record.bags.writer import BagWriter
from ab_sim.record.recording import Recording, open_recording
from tests.recorded import RecordedRun, read_recording


def export_of(
    path: Path,
    description: dict[str, Any],
    channels: Iterable[str],
    samples: NDArray[Any],
    namespace: str = "/",
) -> RecordedRun:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "made.rrd")
        with Recording(file, description=description) as recording:
            recording.block(list(channels), samples)
        export_bag(open_recording(file), path, namespace)
        return read_recording(file)


def block_of(channels: Iterable[str], samples: NDArray[Any]) -> bytes:
    return encoded(topics.BLOCK, Block(tuple(channels), samples))


def bag_of(path: Path, messages: Iterable[tuple[str, int, bytes]], **types: str) -> Path:
    """Write a bag of messages and return its path.

    Parameters
    ----------
    path
        Folder of the bag.
    messages
        Topic, time [ns] and CDR bytes of each message.
    types
        Message type by topic, with _ for /; default: that of the topic's contract.
    """
    with BagWriter(path) as bag:
        known = set()
        for topic, time, message in messages:
            if topic not in known:
                known.add(topic)
                kind = topic_by_name(topic) or topics.WHIRL
                type_name = types.get(topic.strip("/").replace("/", "_"), kind.type_name)
                bag.topic(topic, type_name, offered_qos(kind.qos))
            bag.write(topic, time, message)
    return path
