"""`drive_sim` on a machine that compiles slowly, with a message for each compilation.

    python -m tests.nodes.slow_to_compile SECONDS --ros-args ...

Each compilation by LLVM takes SECONDS longer.
"""

import sys
import time
from typing import Any

from ab_sim.nodes import drive_sim
from ab_sim.tracing.machine_code import MachineCode

MODULE = "tests.nodes.slow_to_compile"
COMPILES = "[compiles]"


def slow_down(seconds: float) -> None:
    """Delay each compilation by ``seconds`` from now on."""
    make = MachineCode.__init__

    def slowly(made: MachineCode, *arguments: Any, **options: Any) -> None:
        print(COMPILES, flush=True)
        time.sleep(seconds)
        make(made, *arguments, **options)

    MachineCode.__init__ = slowly  # type: ignore[method-assign]


def main() -> None:
    slow_down(float(sys.argv.pop(1)))
    drive_sim.main()


if __name__ == "__main__":
    main()
