"""One file on its way into a viewer."""

import os
import subprocess
import threading
from pathlib import Path

from ab_sim.viewing.program import Program

POLL = 0.05
"""s between two looks at whether the file has grown."""
PIECE = 1 << 18
"""bytes."""


class Feed:
    """A process that sends a file to a running viewer, from its beginning, as the file grows.

    A thread reads the file and writes what it reads to the process' standard input, which takes
    no more when the viewer does not keep up and 100 MB wait in that process.

    Args:
        path: what `ab_sim.recording.Recording` writes, or has written.
        host: IP address of the viewer.
        port: of its proxy, where somebody listens now.
        program: starts the process.
    """

    def __init__(self, path: Path, host: str, port: int, program: Program) -> None:
        self.path = path
        self.sent = 0
        # Without a screen: were nobody there after all, it would open a window of its own.
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
        """Bytes that the file has and the process was not given yet."""
        try:
            return max(self.path.stat().st_size - self.sent, 0)
        except OSError:
            return 0  # deleted; what is open is still read

    @property
    def over(self) -> bool:
        """Whether the process has ended."""
        return self._started.process.poll() is not None

    @property
    def broken(self) -> str:
        """Why nothing gets through any more, or nothing."""
        if complaint := self._started.complaint:
            return complaint
        code = self._started.process.poll()
        return f"ended with exit code {code}" if code else ""

    def finish(self) -> None:
        """The file will not grow any more: end when all of it is sent."""
        self._finished.set()

    def wait(self, patience: float) -> bool:
        """Wait so long [s] for the end that `finish` asked for; whether it has come."""
        try:
            self._started.process.wait(patience)
        except subprocess.TimeoutExpired:
            return False
        return True

    def stop(self) -> None:
        """End now."""
        self._stopping.set()
        # What it holds cannot get through. Killed, it takes no more, and the thread notices.
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
                    finished = self._finished.is_set()  # before reading: what came until then
                    if size := file.readinto(room):
                        self._give(pipe.fileno(), memoryview(room)[:size])
                    elif finished:
                        break
                    else:
                        self._stopping.wait(POLL)
        except OSError:
            # The process has ended, or the file cannot be read: then that ends the process.
            pass

    def _give(self, pipe: int, rest: memoryview) -> None:
        while rest:
            given = os.write(pipe, rest)
            self.sent += given
            rest = rest[given:]
