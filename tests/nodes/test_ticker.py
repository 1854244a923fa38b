"""Ticks of a period, and those that are lost."""

import pytest

from ab_sim.nodes.ticker import Ticker


def test_ticks_stay_on_their_grid() -> None:
    ticker = Ticker(0.005, 100.0)
    assert not ticker.due(100.0049) and ticker.wait(100.0) == pytest.approx(0.005)
    assert ticker.due(100.007) and not ticker.due(100.0099) and ticker.due(100.0101)
    assert ticker.lost == 0 and ticker.warning() == ""


def test_lost_ticks_are_counted_and_told_once() -> None:
    ticker = Ticker(0.005, 0.0)
    assert ticker.due(0.3021) and ticker.lost == 59
    assert ticker.warning() == "no tick for 0.302 s: this process was kept from running"
    assert ticker.wait(0.3021) == pytest.approx(0.0029) and ticker.due(0.305)
    assert ticker.lost == 59 and ticker.warning() == ""
