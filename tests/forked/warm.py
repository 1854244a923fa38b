"""Preparation of the process from which others are forked.

In addition to imports it makes a short run, which creates the compiled loop of all runs in half a
second. It does not import rerun, which starts threads, because threads are not forked.
"""

import contextlib

import ab_sim
import ab_sim.cli.app
import ab_sim.cli.run
import ab_sim.show.run

with contextlib.suppress(ImportError):  # without ROS 2
    import ab_sim.nodes.caller
    import ab_sim.nodes.drive_sim
    import ab_sim.nodes.profile_controller  # noqa: F401

ab_sim.simulate(ab_sim.load_scene("thesis-hold", ["duration=0.01"]))
