"""Block of integration samples as a Float64MultiArray with labelled dimensions."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ab_msgs_py.ros_messages import Fields, MalformedMessage


@dataclass(frozen=True)
class Block:
    """Consecutive integration samples; rows are samples, columns are named channels.

    The label of the first dimension is ``sample``. That of the second is the names of the channels,
    separated by commas, beginning with ``step``, the number of the integration step. A gap between
    the steps of two blocks shows that a block was lost.
    """

    channels: tuple[str, ...]
    """Names of the columns; the first one is ``step``."""
    samples: np.ndarray
    """Samples of shape (samples, channels), float64."""

    def fields(self) -> Fields:
        """Return the fields of a Float64MultiArray."""
        rows, columns = self.samples.shape
        labels = ",".join(self.channels)
        dimensions = [
            {"label": "sample", "size": rows, "stride": rows * columns},
            {"label": labels, "size": columns, "stride": columns},
        ]
        return {
            "layout": {"dim": dimensions, "data_offset": 0},
            "data": np.ascontiguousarray(self.samples, dtype=np.float64).ravel(),
        }

    @classmethod
    def of(cls, message: Any) -> "Block":
        """Return the block in a message of ``vibration/block``.

        Raises
        ------
        MalformedMessage
            Dimensions, labels and data do not fit together.
        """
        dimensions = list(message.layout.dim)
        if len(dimensions) != 2 or dimensions[0].label != "sample":
            raise MalformedMessage("vibration/block must have the dimensions sample and channels")
        rows, columns = dimensions[0].size, dimensions[1].size
        channels = tuple(dimensions[1].label.split(","))
        if len(channels) != columns or channels[0] != "step":
            raise MalformedMessage(
                f"vibration/block has {columns} columns but the channels {channels}; "
                "expected step and one name per column"
            )
        data = np.frombuffer(message.data, dtype=np.float64)
        if data.size != rows * columns:
            raise MalformedMessage(
                f"vibration/block has {data.size} values for {rows} x {columns} samples"
            )
        samples = data.reshape(rows, columns)
        steps = samples[:, 0]
        if not (
            np.all(np.isfinite(steps))
            and np.all(steps == np.rint(steps))
            and np.all(np.diff(steps) > 0)
        ):
            raise MalformedMessage("vibration/block: step must be whole numbers that increase")
        return cls(channels, samples)
