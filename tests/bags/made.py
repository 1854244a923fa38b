"""Bags to read, and recordings to make them of."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from ab_sim.bags import BagWriter, export_bag
from ab_sim.bags.contract import KINDS
from ab_sim.recording import RecordedRun, Recording, open_recording, read_recording


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


def bag_of(path: Path, messages: Iterable[tuple[str, int, bytes]], **types: str) -> Path:
    """Of (topic, time [ns], CDR); types by the topics' names with _ for /, or the contract's."""
    with BagWriter(path) as bag:
        known = set()
        for topic, time, message in messages:
            if topic not in known:
                known.add(topic)
                kinds = [k for k in KINDS.values() if topic.endswith("/" + k.name.lstrip("/"))]
                kind = max(kinds, key=lambda k: len(k.name)) if kinds else KINDS["whirl"]
                bag.topic(topic, types.get(topic.strip("/").replace("/", "_"), kind.type), kind.qos)
            bag.write(topic, time, message)
    return path
