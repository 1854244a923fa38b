"""`ab-sim` in a separate process or in the process of the tests."""

import os
import subprocess
import sys
from pathlib import Path
from tempfile import NamedTemporaryFile

from typer.testing import CliRunner

from ab_sim.base.errors import AbSimError
from ab_sim.cli.app import app
from tests.forked import WIDTH, forked
from tests.waiting import PATIENCE

PNG = b"\x89PNG\r\n"


class Command:
    """Running command in a separate process and session, with tables 200 columns wide.

    The process is forked from one that has run a scene. Processes of ``test_interruption`` start
    from scratch.

    Parameters
    ----------
    arguments
        Arguments of `ab-sim`.
    cwd
        Working directory.
    environment
        Environment variables in addition to those of the test process.
    """

    def __init__(self, *arguments: str, cwd: Path | None = None, **environment: str) -> None:
        self._arguments = arguments
        self._files = [NamedTemporaryFile(), NamedTemporaryFile()]
        variables = {**os.environ, **WIDTH, **environment}
        names = [file.name for file in self._files]
        self._process = forked(_run, arguments, cwd or Path.cwd(), variables, *names)

    def runs(self) -> bool:
        return self._process.is_alive()

    def signal(self, number: int) -> None:
        """Send a signal to all processes of the command."""
        assert self._process.pid is not None
        os.killpg(self._process.pid, number)

    def done(self) -> subprocess.CompletedProcess[str]:
        """Wait until the command ends, and return its exit code and output."""
        self._process.join(PATIENCE)
        code = self._process.exitcode
        assert code is not None, f"{self._arguments}: not done after {PATIENCE} s"
        texts = []
        for file in self._files:
            with file:
                texts.append(file.read().decode())
        return subprocess.CompletedProcess(self._arguments, code, *texts)


def ab_sim(
    *arguments: str, cwd: Path | None = None, **environment: str
) -> subprocess.CompletedProcess[str]:
    """Run a command to its end, and return its exit code and output."""
    return Command(*arguments, cwd=cwd, **environment).done()


def refused(*arguments: str, cwd: Path | None = None) -> str:
    """Return the error of a command with bad input, which must not write into its folder.

    The command runs in this process, which is ten times as fast as a separate one.
    """
    home = Path.cwd()
    folder = cwd or home
    before = set(folder.iterdir())
    os.chdir(folder)
    try:
        done = CliRunner(env=WIDTH).invoke(app, arguments)
    finally:
        os.chdir(home)
    assert set(folder.iterdir()) == before
    error = done.exception
    if error is not None and not isinstance(error, AbSimError | SystemExit):
        raise error
    assert (error.exit_code if isinstance(error, AbSimError) else done.exit_code) == 2, done.output
    assert done.stdout == ""
    return str(error) if isinstance(error, AbSimError) else done.stderr


def _run(arguments: tuple[str, ...], cwd: Path, environment: dict, *files: str) -> None:
    """Run the command in the forked process."""
    from ab_sim.cli import main

    os.setsid()
    for number, file in enumerate(files, start=1):
        os.dup2(os.open(file, os.O_WRONLY), number)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(cwd)
    sys.argv = ["ab-sim", *arguments]
    main()
