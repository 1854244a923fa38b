"""Room for samples, block by block."""

import numpy as np

from ab_sim.design.batch.run_prepared import SampleBuffer


def test_no_two_runs_share_room_and_neighbours_share_a_block() -> None:
    room = SampleBuffer(5, (2**18, 4))  # two in a block
    taken = [room.take(1) for _ in range(5)]
    assert all(one.shape == (1, 2**18, 4) for one in taken)
    assert not any(np.shares_memory(a, b) for i, a in enumerate(taken) for b in taken[:i])
    blocks = [one.base for one in taken]
    assert blocks[0] is blocks[1] is not blocks[2]
    assert len(blocks[4]) == 1, "for the last one, no room is left over"


def test_lanes_without_a_run_have_room_too() -> None:
    room = SampleBuffer(3, (10, 2))
    assert room.take(8).shape == (8, 10, 2)
    assert SampleBuffer(0, (10**6, 10)).take(1).shape == (1, 10**6, 10)
