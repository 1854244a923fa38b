"""The command line `ab-sim`."""

import errno
import io
import os
import sys

from ab_sim.base import interruption

_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)


@interruption.left_at_exit()
def main() -> None:
    """Run the command; for an error of ab_sim, print its message and exit with its code.

    Exit codes: 0 done, 1 refused by a node, 2 bad input, 3 diverged, 130 interrupted.
    """
    interruption.watch()
    _write_utf8()
    from ab_sim.base.errors import AbSimError, Interrupted, visible

    try:
        from ab_sim.cli.app import app

        try:
            app()
        finally:
            sys.stdout.flush()
    except AbSimError as error:
        print(f"ab-sim: {visible(str(error))}", file=sys.stderr)
        if isinstance(error, Interrupted):
            interruption.exit_process(error.exit_code)
        sys.exit(error.exit_code)
    except OSError as error:
        if error.errno not in _NO_ROOM or error.filename is not None:
            raise
        print(f"ab-sim: cannot write standard output: {error.strerror}", file=sys.stderr)
        # Python flushes standard output again at exit, which would fail again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(2)


def _write_utf8() -> None:
    """Write UTF-8 to files and pipes on Windows, whose encoding lacks most characters."""
    if sys.platform == "win32":
        for stream in (sys.stdout, sys.stderr):
            assert isinstance(stream, io.TextIOWrapper)
            stream.reconfigure(encoding="utf-8")
