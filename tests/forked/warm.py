"""What the process has behind it from which others are forked.

A short run, beside imports: it makes what takes the steps of all runs, which takes half a second.
Nothing of it imports rerun, which starts threads, and they are not forked.
"""

import contextlib

import ab_sim
import ab_sim.cli.app
import ab_sim.cli.run
import ab_sim.show.figures.run

with contextlib.suppress(ImportError):  # without ROS 2
    import ab_sim.nodes.caller
    import ab_sim.nodes.drive_sim
    import ab_sim.nodes.profile_controller  # noqa: F401

ab_sim.simulate(ab_sim.load_scene("thesis-hold", ["duration=0.01"]))
