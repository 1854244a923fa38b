"""`ab-sim` in a process of its own."""

import multiprocessing
import os
import subprocess
import sys
from multiprocessing import forkserver
from pathlib import Path
from tempfile import NamedTemporaryFile

PNG = b"\x89PNG\r\n"
WIDTH = {"COLUMNS": "200"}
SERVER = multiprocessing.get_context("forkserver")
SERVER.set_forkserver_preload(["tests.cli.warm", "pyarrow.parquet", "scipy.stats", "pandas"])


def ab_sim(*arguments: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run a command, its tables 200 columns wide.

    Its process is forked from one that has imported what commands need, and has run a scene: there
    are hundreds, and that would take each a second or two. Those in ``test_interruption`` begin
    from nothing.
    """
    before = dict(os.environ)
    os.environ.update(WIDTH)  # Consoles look at it when they are imported.
    forkserver.ensure_running()
    os.environ.clear()
    os.environ.update(before)
    with NamedTemporaryFile() as out, NamedTemporaryFile() as err:
        task = arguments, cwd or Path.cwd(), before | WIDTH, out.name, err.name
        process = SERVER.Process(target=_run, args=task)
        process.start()
        process.join(280)
        assert process.exitcode is not None, f"{arguments}: not done after 280 s"
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
