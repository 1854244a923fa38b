"""A command whose work is kept part by part, ended by signals while it is at work."""

import os
import subprocess
import sys
from pathlib import Path

from pyarrow import parquet

from tests.waiting import PATIENCE, until

ROOT = Path(__file__).resolve().parents[2]


class KeptWork:
    """A command, given again and again, with what it keeps in a folder of its own.

    Args:
        folder: for that, and for what the command writes.
        arguments: of `ab-sim`.
    """

    def __init__(self, folder: Path, *arguments: str) -> None:
        self._folder, self._command = folder, [sys.executable, "-m", "ab_sim", *arguments]
        cache = str(folder / "cache")
        self._environment = {**os.environ, "XDG_CACHE_HOME": cache, "PYTHONPATH": str(ROOT)}

    def parts(self) -> list[Path]:
        """Files that are kept."""
        return list(self._folder.glob("cache/ab_sim/results/judged-*/*.parquet"))

    def runs(self) -> list[int]:
        """Numbers of the runs that are kept, as often as they are on disk."""
        return [run for file in self.parts() for run in parquet.read_table(file)["run"].to_pylist()]

    def begin(self, further: int) -> "subprocess.Popen[str]":
        """Start the command, and wait until `further` parts more are kept."""
        wanted = len(self.parts()) + further
        program = subprocess.Popen(
            self._command,
            cwd=self._folder,
            env=self._environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

        def are_kept() -> bool:
            assert program.poll() is None, program.communicate()
            return len(self.parts()) >= wanted

        until(are_kept, f"{wanted} parts are kept", PATIENCE)
        return program

    def ended_by(self, number: int, further: int) -> int:
        """Send a signal to all its processes after `further` parts; return its exit code."""
        program = self.begin(further)
        os.killpg(program.pid, number)
        program.communicate(timeout=PATIENCE)
        return program.returncode

    def whole(self) -> "subprocess.CompletedProcess[str]":
        """The command once more, to its end."""
        return subprocess.run(
            self._command, cwd=self._folder, env=self._environment, capture_output=True, text=True
        )
