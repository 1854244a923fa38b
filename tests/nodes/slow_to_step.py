"""`drive_sim` whose step takes long once ``SPEED`` is commanded.

python -m tests.nodes.slow_to_step SECONDS --ros-args ...
"""

import sys
import time
from typing import Any

from ab_sim.drive import Drive
from ab_sim.nodes import drive_sim

MODULE = "tests.nodes.slow_to_step"
STALLS, GOES_ON = "[stalls]", "[goes on]"
"""Messages before and after the delay."""
SPEED = 100.0
"""Command that causes the delay [rad/s]."""


def slow_down(seconds: float) -> None:
    """Delay the first steps after the command by ``seconds``."""
    advance = Drive.advance
    taken: list[int] = []

    def slowly(drive: Drive, steps: int) -> Any:
        if drive.snapshot().command == SPEED and not taken:
            taken.append(drive.steps)
            print(STALLS, flush=True)
            time.sleep(seconds)
            print(GOES_ON, flush=True)
        return advance(drive, steps)

    Drive.advance = slowly  # type: ignore[method-assign]


def main() -> None:
    slow_down(float(sys.argv.pop(1)))
    drive_sim.main()


if __name__ == "__main__":
    main()
