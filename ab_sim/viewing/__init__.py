"""Show recordings while they grow, in Rerun's viewer, without whoever writes them noticing.

Who records only ever writes a file. A `Viewer` is a process of its own, or one that somebody else
has started; each file that it shows has a `Feed`, a second process, which is handed what the file
has and sends it there. A viewer that is slow, stopped, killed or absent keeps a feed waiting, and
nobody else.

(Rerun 0.41 can follow a growing file by itself, but stops after a second. A client of its server
in the process that records would block for good once the server is gone and 100 MB wait.)
"""

from ab_sim.viewing.program import screens
from ab_sim.viewing.viewer import NATIVE, SHOWING, STARTED, WEB, Viewer, check_view

__all__ = ["NATIVE", "SHOWING", "STARTED", "WEB", "Viewer", "check_view", "screens"]
