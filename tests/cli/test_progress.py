"""Progress where there is no terminal."""

import time

import pytest

from ab_sim.cli import progress


def test_without_a_terminal_lines_say_now_and_then_what_is_done(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Also while nothing new is told."""
    assert not progress.people.is_terminal
    monkeypatch.setattr(progress, "EVERY", 0.01)
    said, deadline = "", time.monotonic() + 60.0
    with progress.progress_bar("a scene") as tell:
        tell("branches [2+0]", 3, 41)
        while said.count("\n") < 2:
            said += capsys.readouterr().err
            assert time.monotonic() < deadline
    assert {*said.splitlines()} == {"a scene: branches [2+0], 3 of 41"}
