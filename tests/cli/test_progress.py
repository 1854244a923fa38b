"""Progress where there is no terminal."""

import pytest

from ab_sim.cli import progress


def test_without_a_terminal_lines_are_printed_now_and_then(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert not progress.people.is_terminal
    now = 100.0
    monkeypatch.setattr(progress.time, "monotonic", lambda: now)
    with progress.progress_bar("a scene") as tell:
        for k in range(41):
            now = 100.0 + k
            tell("branches [2+0]", k, 41)
    said = capsys.readouterr().err.splitlines()
    assert said == [f"a scene: branches [2+0], {k} of 41" for k in (10, 20, 30, 40)]
