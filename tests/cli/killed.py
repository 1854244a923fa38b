"""A command whose work is kept part by part, ended by signals while it is at work."""

import subprocess
from pathlib import Path

from pyarrow import parquet

from tests.cli.tool import Command
from tests.waiting import PATIENCE, until


class KeptWork:
    """A command, given again and again, with what it keeps in a folder of its own.

    Args:
        folder: for that, and for what the command writes.
        arguments: of `ab-sim`.
    """

    def __init__(self, folder: Path, *arguments: str) -> None:
        self._folder, self._arguments = folder, arguments

    def parts(self) -> list[Path]:
        """Files that are kept."""
        return list(self._folder.glob("cache/ab_sim/results/judged-*/*.parquet"))

    def runs(self) -> list[int]:
        """Numbers of the runs that are kept, as often as they are on disk."""
        return [run for file in self.parts() for run in parquet.read_table(file)["run"].to_pylist()]

    def begin(self, further: int) -> Command:
        """Start the command, and wait until `further` parts more are kept."""
        wanted = len(self.parts()) + further
        command = self._command()

        def are_kept() -> bool:
            assert command.runs(), command.done()
            return len(self.parts()) >= wanted

        until(are_kept, f"{wanted} parts are kept", PATIENCE)
        return command

    def ended_by(self, number: int, further: int) -> int:
        """Send a signal to all its processes after `further` parts; return its exit code."""
        command = self.begin(further)
        command.signal(number)
        return command.done().returncode

    def whole(self) -> "subprocess.CompletedProcess[str]":
        """The command once more, to its end."""
        return self._command().done()

    def _command(self) -> Command:
        cache = str(self._folder / "cache")
        return Command(*self._arguments, cwd=self._folder, XDG_CACHE_HOME=cache)
