"""Preparation of the process from which others are forked; the last module that it imports.

In addition to imports it makes a short run, which creates the compiled loop of all runs in half a
second, and finds the file of each module, as ROS's logger does for its first message. It does not
import rerun, which starts threads, because threads are not forked.
"""

import contextlib
import gc
import inspect

import ab_sim
import ab_sim.cli.app
import ab_sim.cli.run
import ab_sim.show.run

with contextlib.suppress(ImportError):  # without ROS 2
    from rclpy.type_support import check_for_type_support

    import ab_sim.nodes.caller
    import ab_sim.nodes.drive_sim
    import ab_sim.nodes.profile_controller  # noqa: F401
    from ab_msgs_py import topics

    for topic in topics.ALL:
        if topic.type is not None:
            check_for_type_support(topic.type)

ab_sim.simulate(ab_sim.load_scene("thesis-hold", ["duration=0.01"]))
inspect.getmodule(inspect.currentframe())
gc.collect()
gc.freeze()  # collections in forked processes would visit, and thereby copy, all objects
