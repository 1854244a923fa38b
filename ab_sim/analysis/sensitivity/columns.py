"""How numbers with a column for each key lie in blocks of lanes, block under block."""

import math
from typing import NamedTuple

import numpy as np

from ab_sim.compiling.kinds import aligned


class Columns(NamedTuple):
    """Of tables that the driver of tangents works with."""

    keys: int
    lanes: int
    clock: bool
    """Whether there is one column more."""

    @property
    def blocks(self) -> int:
        """Of lanes."""
        return -(-(self.keys + self.clock) // self.lanes)

    def room(self, lines: int, first: int = 1) -> np.ndarray:
        """Zeros for ``first`` times so many lines, shape (first * blocks * lines, lanes)."""
        return aligned((first * self.blocks * lines, self.lanes))

    def table(self, values: np.ndarray) -> np.ndarray:
        """Values of shape (.., lines, keys) as such a table."""
        *first, lines, keys = values.shape
        wide = np.zeros((*first, lines, self.blocks * self.lanes))
        wide[..., :keys] = values
        count = math.prod(first)
        found = self.room(lines, count)
        parted = wide.reshape(count, lines, self.blocks, self.lanes)
        found[:] = parted.transpose(0, 2, 1, 3).reshape(found.shape)
        return found

    def values(self, table: np.ndarray, lines: int) -> np.ndarray:
        """Of such a table, shape (first, lines, keys)."""
        parted = table.reshape(-1, self.blocks, lines, self.lanes).transpose(0, 2, 1, 3)
        whole: np.ndarray = parted.reshape(len(parted), lines, self.blocks * self.lanes)
        return whole[..., : self.keys]
