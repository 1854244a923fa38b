"""ROS 2 bags: recordings as others have them, for Foxglove, PlotJuggler and ``ros2 bag``.

A bag is a folder as ``rosbag2`` makes it, of format version 9: ``metadata.yaml``, and one MCAP file
of the folder's name, in chunks compressed by zstd. Its messages are those of the topic contract
(`ab_msgs_py`), of standard types, in CDR. rosbags reads and writes them; no ROS is needed.

What is written is in the file at every `BagWriter.flush`. A bag whose writer was killed has no MCAP
summary, and no counts in ``metadata.yaml``: `Bag` reads it up to the last whole chunk, and says
that it is not complete; so do others, unless it was killed in the middle of writing. `mend_bag`
completes it.
"""

from ab_sim.bags.exporting import STATE_RATE, export_bag
from ab_sim.bags.importing import Imported, import_bag
from ab_sim.bags.mending import Mending, mend_bag
from ab_sim.bags.reader import Bag
from ab_sim.bags.writer import BagWriter

__all__ = [
    "STATE_RATE",
    "Bag",
    "BagWriter",
    "Imported",
    "Mending",
    "export_bag",
    "import_bag",
    "mend_bag",
]
