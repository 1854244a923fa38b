"""Rerun's program, and processes of this program that pass a growing file to a viewer."""

import importlib.util
import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence
from pathlib import Path

from ab_sim.base.errors import InputError

_SCREENS = ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET")
# Runs in the new process before it becomes Rerun, so that it receives SIGTERM when the thread that
# started it ends, even by SIGKILL (Linux). A preexec_fn could deadlock if other threads are busy.
_TIED = (
    "import ctypes, os, sys; ctypes.CDLL(None).prctl(1, 15); os.execv(sys.argv[1], sys.argv[1:])"
)


def screens() -> bool:
    """Return whether a window can be opened; macOS and Windows have a screen without X11."""
    return sys.platform in ("darwin", "win32") or any(os.environ.get(name) for name in _SCREENS)


class Program:
    """Starter of Rerun's program; a temporary folder holds the output of its processes.

    The bundled binary is started directly, because the script ``rerun`` around it may exit before
    or after it. Its settings are in the same folder, with analytics off, so that nothing is sent
    and the user's settings stay unchanged.

    Raises
    ------
    InputError
        The program is not installed.
    """

    def __init__(self) -> None:
        spec = importlib.util.find_spec("rerun_cli")
        places = [] if spec is None else list(spec.submodule_search_locations or [])
        name = "rerun.exe" if sys.platform == "win32" else "rerun"
        programs = [place for place in (Path(p, name) for p in places) if place.is_file()]
        if not programs:
            raise InputError(
                "Rerun's viewer is not installed; install it with `pip install rerun-sdk`"
            )
        self._path = str(programs[0])
        self._folder = tempfile.TemporaryDirectory(prefix="ab_sim-viewer-")
        self._logs = 0
        self._environment = {**os.environ, "XDG_CONFIG_HOME": self._folder.name, "NO_COLOR": "1"}
        subprocess.run(
            [self._path, "analytics", "disable"],
            env=self._environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            check=False,
        )

    def start(
        self, arguments: Sequence[str], *, stdin: int = subprocess.DEVNULL, tied: bool, screen: bool
    ) -> "Started":
        """Start a process that Ctrl-C in this terminal does not reach.

        Parameters
        ----------
        arguments
            Arguments of the program.
        stdin
            As in ``subprocess.Popen``.
        tied
            Whether the process exits with the calling thread, even if it is killed; on Linux only.
        screen
            Whether the process may open a window.
        """
        self._logs += 1
        log = Path(self._folder.name, f"{self._logs}.log")
        hidden = () if screen else _SCREENS
        tie = [sys.executable, "-I", "-S", "-c", _TIED] if tied and sys.platform == "linux" else []
        with log.open("wb") as writing:
            process = subprocess.Popen(
                [*tie, self._path, *arguments],
                env={k: v for k, v in self._environment.items() if k not in hidden},
                stdin=stdin,
                stdout=writing,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        return Started(process, log)

    def close(self) -> None:
        """Remove the folder."""
        self._folder.cleanup()


class Started:
    """Process that was started, and the file with its output."""

    def __init__(self, process: subprocess.Popen[bytes], log: Path) -> None:
        self.process, self._log = process, log

    @property
    def last_error(self) -> str:
        """Last error in the output; empty if there is none."""
        try:
            lines = self._log.read_text(encoding="utf-8", errors="replace").splitlines()
        except OSError:
            return ""
        errors = [line for line in lines if "ERROR" in line or line.startswith(("Error", "error"))]
        return errors[-1].partition("ERROR")[2].strip() or errors[-1] if errors else ""

    def end(self, patience: float) -> None:
        """Terminate the process, and kill it if it has not exited after ``patience`` [s]."""
        self.process.terminate()
        try:
            self.process.wait(patience)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


_POLL = 0.05
"""Time between two checks whether the file has grown [s]."""
_PIECE = 1 << 18
"""Largest number of bytes that are read at a time."""


class Feed:
    """Process that sends a growing file from its beginning to a running viewer.

    A thread reads the file and writes its content to the standard input of the process. The write
    blocks if the viewer does not keep up and 100 MB wait in the process.

    Parameters
    ----------
    path
        File that `ab_sim.record.recording.Recording` writes, or has written.
    host
        IP address of the viewer.
    port
        Port of the viewer's proxy, which is already listening.
    program
        Program that starts the process.
    """

    def __init__(self, path: Path, host: str, port: int, program: Program) -> None:
        self.path = path
        self.sent = 0
        """Number of bytes that the process has received."""
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
        if error := self._started.last_error:
            return error
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
        """Copy the growing file to the process until `stop`, or up to its end after `finish`."""
        pipe = self._started.process.stdin
        assert pipe is not None
        buffer = bytearray(_PIECE)
        try:
            with pipe, self.path.open("rb", buffering=0) as file:
                while not self._stopping.is_set():
                    # Queried before reading, so that everything written until then is read.
                    finished = self._finished.is_set()
                    if size := file.readinto(buffer):
                        self._write(pipe.fileno(), memoryview(buffer)[:size])
                    elif finished:
                        break
                    else:
                        self._stopping.wait(_POLL)
        except OSError:
            # The process has ended, or the file cannot be read, which ends the process.
            pass

    def _write(self, pipe: int, rest: memoryview) -> None:
        """Write bytes to the process; this blocks while the process does not read."""
        while rest:
            written = os.write(pipe, rest)
            self.sent += written
            rest = rest[written:]
