"""The command line `ab-sim`."""

import sys


def main() -> None:
    """Entry point: runs the command; errors are one message and an exit code (0, 2 or 3)."""
    from ab_sim.cli.app import app
    from ab_sim.errors import AbSimError

    try:
        app()
    except AbSimError as error:
        print(f"ab-sim: {error}", file=sys.stderr)
        sys.exit(error.exit_code)
    except KeyboardInterrupt:
        print("ab-sim: interrupted", file=sys.stderr)
        sys.exit(130)
