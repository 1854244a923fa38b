"""ROS 2 bags: recordings in ROS's own format, for Foxglove, PlotJuggler and ``ros2 bag``.

A bag is a folder in the format of ``rosbag2``, version 9: ``metadata.yaml``, and one MCAP file with
the folder's name, in chunks compressed by zstd. Its messages are those of the topic contract
(`ab_msgs_py`), of standard types, in CDR. The package rosbags reads and writes them; no ROS is
needed.

Messages are in the file after each `BagWriter.flush`. A bag whose writer was killed has no MCAP
summary, and no counts in ``metadata.yaml``: `Bag` reads it up to the last complete chunk, and sets
``complete`` to False. Other programs can also read it, unless the writer was killed during a write.
`repair_bag` adds what is missing.
"""
