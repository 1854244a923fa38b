"""Rerun's program, started without reports over the network."""

import importlib.util
import os
import subprocess
import sys
import tempfile
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
    """Return whether a window can be opened."""
    return any(os.environ.get(name) for name in _SCREENS)


class Program:
    """Starter of Rerun's program; a temporary folder holds the output of its processes.

    The bundled binary is started directly, because the script ``rerun`` around it may exit before
    or after it. Its settings are in the same folder, with analytics off, so that nothing is sent
    and the user's settings stay unchanged.

    Raises:
        InputError: the program is not installed.
    """

    def __init__(self) -> None:
        spec = importlib.util.find_spec("rerun_cli")
        places = [] if spec is None else list(spec.submodule_search_locations or [])
        programs = [place for place in (Path(p, "rerun") for p in places) if place.is_file()]
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

        Args:
            arguments: arguments of the program.
            stdin: as in ``subprocess.Popen``.
            tied: whether the process exits with the calling thread.
            screen: whether the process may open a window.
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
    """Started process and its output."""

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
        """Terminate the process, and kill it if it has not exited after ``patience`` [s]."""
        self.process.terminate()
        try:
            self.process.wait(patience)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
