"""Node in a forked process, with the interface of a process that was started."""

import os
import signal
import sys
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path

from tests.forked import forked


class ForkedNode:
    """Replacement of `subprocess.Popen` for nodes, with the methods that tests use.

    Parameters
    ----------
    module
        Module whose ``main`` is the node.
    arguments
        Arguments after the program's name.
    environment
        Complete environment of the process.
    log
        File for its output.
    """

    def __init__(
        self, module: str, arguments: list[str], environment: Mapping[str, str], log: Path
    ) -> None:
        log.write_bytes(b"")  # there to be read from now on
        self._process = forked(_run, module, arguments, dict(environment), str(log))
        self.pid = self._process.pid

    def poll(self) -> int | None:
        """Return the exit code; None while the process runs."""
        return self._process.exitcode

    def wait(self, timeout: float | None = None) -> int:
        """Wait for the exit and return the exit code."""
        self._process.join(timeout)
        code = self.poll()
        if code is None:
            raise TimeoutError(f"{self._process.name}: not ended after {timeout} s")
        return code

    def send_signal(self, number: int) -> None:
        """Send a signal, if the process runs."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        """Kill the process."""
        self.send_signal(signal.SIGKILL)


def _run(module: str, arguments: list[str], environment: dict[str, str], log: str) -> None:
    """Run the node in the forked process."""
    file = os.open(log, os.O_WRONLY)
    for number in (1, 2):
        os.dup2(file, number)
    sys.stdout.reconfigure(line_buffering=True)  # type: ignore[union-attr]
    os.environ.clear()
    os.environ.update(environment)
    sys.argv = [module, *arguments]
    import_module(module).main()
