"""The command line `ab-sim`."""

import sys


def main() -> None:
    """Entry point: runs the command; errors are one message and an exit code.

    0 done, 2 bad input, 3 diverged, 130 interrupted.
    """
    from ab_sim.errors import AbSimError

    try:
        from ab_sim.cli.app import app

        app()
    except AbSimError as error:
        print(f"ab-sim: {error}", file=sys.stderr)
        sys.exit(error.exit_code)
    except KeyboardInterrupt:
        print("ab-sim: interrupted", file=sys.stderr)
        sys.exit(130)
