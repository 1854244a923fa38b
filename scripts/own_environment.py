"""Run a node with the Python of the environment that this file is installed in.

`ros2 run` and `ros2 launch` execute `<prefix>/lib/ab_sim/<node>`. pip rewrites `#!` lines only in
`<prefix>/bin`. So in an environment that is not activated, `#!/usr/bin/env python3` finds a Python
without ab_sim; the right one is `<prefix>/bin/python3`. colcon's prefix has no Python: there,
`python3` of the path is right, with the workspace's `PYTHONPATH`.
"""

import os
import sys
from importlib import import_module
from pathlib import Path
from typing import NoReturn


def run(node: str) -> NoReturn:
    """Call ``main`` of ``ab_sim.nodes.<node>``, if needed in a restarted Python of the prefix."""
    prefix = Path(__file__).absolute().parents[2]
    if (prefix / "pyvenv.cfg").exists() and not os.path.samefile(prefix, sys.prefix):
        # ROS wheels of the other environment may have set this variable, which would keep ours
        # from setting their library path.
        os.environ.pop("_ROS_WHEELS_BOOTSTRAP_COMPLETE", None)
        python = str(prefix / "bin" / "python3")
        os.execv(python, [python, *sys.argv])
    import_module("ab_sim.base.interruption").watch()
    sys.exit(import_module(f"ab_sim.nodes.{node}").main())
