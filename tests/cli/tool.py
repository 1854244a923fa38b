"""`ab-sim` in a process of its own."""

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


def ab_sim(*arguments: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run a command, its tables 200 columns wide.

    Its process is forked from one that has run a scene. Those in ``test_interruption`` begin from
    nothing.
    """
    with NamedTemporaryFile() as out, NamedTemporaryFile() as err:
        environment = dict(os.environ) | WIDTH
        process = forked(_run, arguments, cwd or Path.cwd(), environment, out.name, err.name)
        process.join(PATIENCE)
        assert process.exitcode is not None, f"{arguments}: not done after {PATIENCE} s"
        texts = [file.read().decode() for file in (out, err)]
    return subprocess.CompletedProcess(arguments, process.exitcode, *texts)


def refused(*arguments: str, cwd: Path | None = None) -> str:
    """Return the error of a command with bad input, which writes nothing into its folder.

    It runs in this process, which is ten times as fast as one of its own.
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
    """In the new process."""
    from ab_sim.cli import main

    for number, file in enumerate(files, start=1):
        os.dup2(os.open(file, os.O_WRONLY), number)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(cwd)
    sys.argv = ["ab-sim", *arguments]
    main()
