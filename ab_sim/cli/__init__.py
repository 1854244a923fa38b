"""The command line `ab-sim`."""

import sys

from ab_sim import interruption


@interruption.left_at_exit()
def main() -> None:
    """Entry point: runs the command; errors are one message and an exit code.

    0 done, 1 refused by a node, 2 bad input, 3 diverged, 130 interrupted.
    """
    interruption.watch()
    from ab_sim.errors import AbSimError, Interrupted
    from ab_sim.quoting import visible

    try:
        from ab_sim.cli.app import app

        app()
    except AbSimError as error:
        print(f"ab-sim: {visible(str(error))}", file=sys.stderr)
        if isinstance(error, Interrupted):
            interruption.leave(error.exit_code)
        sys.exit(error.exit_code)
