"""Metadata (``metadata.yaml``) of an unfinished bag; rosbags writes those of a finished one."""

from __future__ import annotations

from collections.abc import Collection
from io import StringIO
from pathlib import Path
from typing import Any

from rosbags.interfaces import Connection, ConnectionExtRosbag2
from rosbags.rosbag2.metadata import dump_qos_v9
from ruamel.yaml import YAML

METADATA = "metadata.yaml"
_UNFINISHED = "ab_sim_unfinished"


def initial_metadata(file: Path, topics: Collection[Connection]) -> bytes:
    """Return the content of ``metadata.yaml`` for an MCAP file and its topics, with counts of 0."""
    none = {"nanoseconds": 0}
    since = {"nanoseconds_since_epoch": 0}
    about: dict[str, Any] = {
        "version": 9,
        "storage_identifier": "mcap",
        "relative_file_paths": [file.name],
        "duration": none,
        "starting_time": since,
        "message_count": 0,
        "topics_with_message_count": [
            {"topic_metadata": _topic(topic), "message_count": 0} for topic in topics
        ],
        "compression_format": "",
        "compression_mode": "",
        "files": [
            {"path": file.name, "starting_time": since, "duration": none, "message_count": 0}
        ],
        "custom_data": {_UNFINISHED: "message counts and times are not those of the file"},
        "ros_distro": "rosbags",
    }
    yaml, text = YAML(typ="safe"), StringIO()
    yaml.default_flow_style = False
    yaml.representer.ignore_aliases = lambda *_: True  # some parsers do not support aliases
    yaml.dump({"rosbag2_bagfile_information": about}, text)
    return text.getvalue().encode()


def is_unfinished(path: Path) -> bool:
    """Return whether a metadata file was written by ``initial_metadata``."""
    return f"{_UNFINISHED}:" in path.read_text(errors="replace")


def _topic(topic: Connection) -> dict[str, Any]:
    assert isinstance(topic.ext, ConnectionExtRosbag2)
    return {
        "name": topic.topic,
        "type": topic.msgtype,
        "serialization_format": topic.ext.serialization_format,
        "offered_qos_profiles": dump_qos_v9(topic.ext.offered_qos_profiles),
        "type_description_hash": topic.digest,
    }
