"""Rerun's own program, started without network reports."""

import importlib.util
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from ab_sim.base.errors import InputError

_SCREENS = ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET")
# Runs in the new process before it becomes Rerun: it is to receive SIGTERM when the thread that
# started it has gone, even by SIGKILL (Linux). Not by preexec_fn, which may deadlock if other
# threads are busy.
_TIED = (
    "import ctypes, os, sys; ctypes.CDLL(None).prctl(1, 15); os.execv(sys.argv[1], sys.argv[1:])"
)


def screens() -> bool:
    """Return whether a window can be opened."""
    return any(os.environ.get(name) for name in _SCREENS)


class Program:
    """Starts Rerun's program; a temporary folder holds the output of its processes.

    The program is the bundled binary itself: the script ``rerun`` around it would outlive it, or be
    outlived by it. Its settings are in that folder too, with analytics off, so that nothing is
    sent, and the user's settings are left alone.

    Raises:
        InputError: the program is not installed.
    """

    def __init__(self) -> None:
        spec = importlib.util.find_spec("rerun_cli")
        places = [] if spec is None else list(spec.submodule_search_locations or [])
        programs = [place for place in (Path(p, "rerun") for p in places) if place.is_file()]
        if not programs:
            raise InputError(
                "a viewer is needed, and Rerun's is not installed: `pip install rerun-sdk`"
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
        """Start a process, which Ctrl-C in our terminal does not reach.

        Args:
            arguments: arguments of the program.
            stdin: as in ``subprocess.Popen``.
            tied: whether it ends with the calling thread.
            screen: whether it may open a window.
        """
        self._logs += 1
        log = Path(self._folder.name, f"{self._logs}.log")
        hidden = () if screen else _SCREENS
        tie = [sys.executable, "-I", "-S", "-c", _TIED] if tied else []
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
    """A process and its output."""

    def __init__(self, process: subprocess.Popen[bytes], log: Path) -> None:
        self.process, self._log = process, log

    @property
    def complaint(self) -> str:
        """Last error in the output; empty if there is none."""
        try:
            lines = self._log.read_text(errors="replace").splitlines()
        except OSError:
            return ""
        errors = [line for line in lines if "ERROR" in line or line.startswith(("Error", "error"))]
        return errors[-1].partition("ERROR")[2].strip() or errors[-1] if errors else ""

    def end(self, patience: float) -> None:
        """Ask the process to exit, and kill it after ``patience`` [s]."""
        self.process.terminate()
        try:
            self.process.wait(patience)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
