"""`ab-sim` in a process of its own."""

import os
import subprocess
import sys
from pathlib import Path
from tempfile import NamedTemporaryFile

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
