"""Transfer of one file to a viewer."""

import os
import subprocess
import threading
from pathlib import Path

from ab_sim.show.viewing.program import Program

POLL = 0.05
"""Time between two checks whether the file has grown [s]."""
PIECE = 1 << 18
"""Size of a block [bytes]."""


class Feed:
    """Process that sends a growing file from its beginning to a running viewer.

    A thread reads the file and writes its content to the standard input of the process. The write
    blocks if the viewer does not keep up and 100 MB wait in the process.

    Args:
        path: file that `ab_sim.record.recording.Recording` writes, or has written.
        host: IP address of the viewer.
        port: port of the viewer's proxy, which is already listening.
        program: program that starts the process.
    """

    def __init__(self, path: Path, host: str, port: int, program: Program) -> None:
        self.path = path
        self.sent = 0
        # Without a screen: if the viewer were gone, the process would open a window.
        self._started = program.start(
            ["--bind", host, "--port", str(port), "-"],
            stdin=subprocess.PIPE,
            tied=True,
            screen=False,
        )
        self._finished = threading.Event()
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._copy, name="feed", daemon=True)
        self._thread.start()

    @property
    def waiting(self) -> int:
        """Number of bytes of the file that the process has not received yet."""
        try:
            return max(self.path.stat().st_size - self.sent, 0)
        except OSError:
            return 0  # deleted; the open file can still be read

    @property
    def over(self) -> bool:
        """True if the process has exited."""
        return self._started.process.poll() is not None

    @property
    def broken(self) -> str:
        """Reason why data no longer reach the viewer; empty if there is none."""
        if complaint := self._started.complaint:
            return complaint
        code = self._started.process.poll()
        return f"ended with exit code {code}" if code else ""

    def finish(self) -> None:
        """Let the process exit when the whole file is sent; the file must not grow any more."""
        self._finished.set()

    def wait(self, patience: float) -> bool:
        """Wait up to ``patience`` [s] for the exit after `finish`; return whether it happened."""
        try:
            self._started.process.wait(patience)
        except subprocess.TimeoutExpired:
            return False
        return True

    def stop(self) -> None:
        """Kill the process and stop the thread."""
        self._stopping.set()
        # A blocked write of the thread fails only once the process is killed.
        self._started.process.kill()
        self._started.process.wait()
        self._thread.join()

    def _copy(self) -> None:
        pipe = self._started.process.stdin
        assert pipe is not None
        room = bytearray(PIECE)
        try:
            with pipe, self.path.open("rb", buffering=0) as file:
                while not self._stopping.is_set():
                    # Queried before reading, so that everything written until then is read.
                    finished = self._finished.is_set()
                    if size := file.readinto(room):
                        self._give(pipe.fileno(), memoryview(room)[:size])
                    elif finished:
                        break
                    else:
                        self._stopping.wait(POLL)
        except OSError:
            # The process has ended, or the file cannot be read, which ends the process.
            pass

    def _give(self, pipe: int, rest: memoryview) -> None:
        while rest:
            written = os.write(pipe, rest)
            self.sent += written
            rest = rest[written:]
