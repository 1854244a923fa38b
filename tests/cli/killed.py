"""Command with cached parts of its work, stopped by signals while it runs."""

import subprocess
from pathlib import Path

from pyarrow import parquet

from tests.cli.tool import Command
from tests.waiting import PATIENCE, until


class KeptWork:
    """Repeated command with a separate cache folder.

    Parameters
    ----------
    folder
        Folder for the cache and for the command's output.
    arguments
        Arguments of `ab-sim`.
    """

    def __init__(self, folder: Path, *arguments: str) -> None:
        self._folder, self._arguments = folder, arguments

    def parts(self) -> list[Path]:
        """Return the files in the cache."""
        return list(self._folder.glob("cache/ab_sim/results/judged-*/*.parquet"))

    def runs(self) -> list[int]:
        """Return the numbers of the cached runs, repeated if they are stored more than once."""
        return [run for file in self.parts() for run in parquet.read_table(file)["run"].to_pylist()]

    def begin(self, further: int) -> Command:
        """Start the command, and wait until `further` more parts are cached."""
        wanted = len(self.parts()) + further
        command = self._command()

        def are_kept() -> bool:
            assert command.runs(), command.done()
            return len(self.parts()) >= wanted

        until(are_kept, f"{wanted} parts are kept", PATIENCE)
        return command

    def ended_by(self, number: int, further: int) -> int:
        """Send a signal to all its processes after `further` more parts; return the exit code."""
        command = self.begin(further)
        command.signal(number)
        return command.done().returncode

    def whole(self) -> "subprocess.CompletedProcess[str]":
        """Run the command once more to its end."""
        return self._command().done()

    def _command(self) -> Command:
        cache = str(self._folder / "cache")
        return Command(*self._arguments, cwd=self._folder, XDG_CACHE_HOME=cache)
