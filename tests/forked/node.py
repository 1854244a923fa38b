"""A node in a forked process, which is watched and ended like one that was started."""

import os
import signal
import sys
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path

from tests.forked import forked


class ForkedNode:
    """What tests ask of `subprocess.Popen`.

    Args:
        module: whose ``main`` is the node.
        arguments: behind the program's name.
        environment: its own, whole.
        log: file for what it prints.
    """

    def __init__(
        self, module: str, arguments: list[str], environment: Mapping[str, str], log: Path
    ) -> None:
        log.write_bytes(b"")  # there to be read from now on
        self._process = forked(_run, module, arguments, dict(environment), str(log))
        self.pid = self._process.pid

    def poll(self) -> int | None:
        """The exit code, or None while it runs."""
        return self._process.exitcode

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its end; the exit code."""
        self._process.join(timeout)
        code = self.poll()
        if code is None:
            raise TimeoutError(f"{self._process.name}: not ended after {timeout} s")
        return code

    def send_signal(self, number: int) -> None:
        """To a process that runs."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        """At once."""
        self.send_signal(signal.SIGKILL)


def _run(module: str, arguments: list[str], environment: dict[str, str], log: str) -> None:
    """In the new process."""
    file = os.open(log, os.O_WRONLY)
    for number in (1, 2):
        os.dup2(file, number)
    sys.stdout.reconfigure(line_buffering=True)  # type: ignore[union-attr]
    os.environ.clear()
    os.environ.update(environment)
    sys.argv = [module, *arguments]
    import_module(module).main()
