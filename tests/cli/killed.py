"""A command whose work is kept part by part, ended by signals while it is at work."""

import os
import subprocess
import sys
import time
from pathlib import Path

from pyarrow import parquet

ENDS = 240.0
"""s; a command that has not kept so much by then never will."""


class KeptWork:
    """A command, given again and again, with what it keeps in a folder of its own.

    Args:
        folder: for that, and for what the command writes.
        arguments: of `ab-sim`.
    """

    def __init__(self, folder: Path, *arguments: str) -> None:
        self._folder, self._command = folder, [sys.executable, "-m", "ab_sim", *arguments]
        self._environment = {**os.environ, "XDG_CACHE_HOME": str(folder / "cache")}

    def runs(self) -> list[int]:
        """Numbers of the runs that are kept, as often as they are on disk."""
        files = self._folder.glob("cache/ab_sim/results/judged-*/*.parquet")
        return [run for file in files for run in parquet.read_table(file)["run"].to_pylist()]

    def ended_by(self, number: int, further: int) -> int:
        """Send a signal to all its processes when so many more runs are kept; its exit code."""
        runs = len(self.runs()) + further
        program = subprocess.Popen(
            self._command, cwd=self._folder, env=self._environment, start_new_session=True
        )
        give_up = time.monotonic() + ENDS
        while len(self.runs()) < runs:
            assert program.poll() is None, f"it ended with {len(self.runs())} runs"
            assert time.monotonic() < give_up, f"it has kept {len(self.runs())} runs"
            time.sleep(0.05)  # a look reads all files, and takes its time from the command
        os.killpg(program.pid, number)
        return program.wait(timeout=ENDS)

    def whole(self) -> subprocess.CompletedProcess[str]:
        """The command once more, to its end."""
        return subprocess.run(
            self._command, cwd=self._folder, env=self._environment, capture_output=True, text=True
        )
