"""Live views of growing recordings in Rerun's viewer, without effect on the recorder.

A recorder only writes a file. A `Viewer` is a separate process that is started here or already
runs. For each file there is a `Feed`, a second process, which receives the content of the file and
sends it to the viewer. A slow, stopped, killed or absent viewer delays only its feed.

Rerun 0.41 can follow a growing file itself, but stops after a second. A client of its server within
the recording process would block forever once the server is gone and 100 MB wait.
"""

from ab_sim.show.viewing.feed import screens
from ab_sim.show.viewing.page import IN_TRANSIT
from ab_sim.show.viewing.viewer import NATIVE, SHOWING, STARTED, WEB, Viewer, check_view

__all__ = ["IN_TRANSIT", "NATIVE", "SHOWING", "STARTED", "WEB", "Viewer", "check_view", "screens"]
