"""Record a run into a Rerun file, bit for bit, with pictures that explain it; and read it back.

A run is a table of float64 *samples*: one row per integration step, one column per *channel*,
the first two being ``step`` (a whole number that grows) and ``time`` [s]. `Recording` writes the
table, `read_recording` returns exactly what was written, and `open_recording` gives it in blocks,
for runs that do not fit into memory.

==========================  ==========================================  ===================
entity                      contents                                    shown as
==========================  ==========================================  ===================
``/clock/time``             time [s] (the timeline is rounded to ns)
``/spindle/angle``          angle psi [rad, unwrapped]
``/spindle/speed``          speed, command [rad/s]                      plot
``/spindle/torque``         motor_torque [N m], with a motor            plot
``/deck/displacement``      x, y [m], inertial axes; z of a deck in
                            space, as in the next two
``/deck/velocity``          vx, vy [m/s]
``/deck/acceleration``      ax, ay [m/s^2]
``/deck/turn``              qw, qx, qy, qz, of a deck in space
``/deck/angular_velocity``  wx, wy, wz [rad/s], on deck axes
``/deck/angular_-``         wx_rate, wy_rate, wz_rate [rad/s^2]
``acceleration``
``/sensors/NAME``           NAME_1, NAME_2 [m/s^2], on the sensor's axes
``/balls/angle``            ball_0_angle, ... [rad, from the
                            unbalance, unwrapped]
``/balls/rate``             ball_0_rate, ... [rad/s]
``/other/NAME``             any other channel
``/plot``, ``/state``       derived: W/e, degrees, mrad, driving
                            forces, lengths of vectors, r.m.s.,
                            orders and spectra of the vibration; what
                            the spindle does                            plots
``/top``, ``/space``        derived: the drawings, in mm, at most 1000
                            times a second                              top view, 3-D view
``/about``                  what is seen                                text
``/run/NAME``               what `Recording.scalar` is given            plot
``/events/SOURCE``          what `Recording.event` is given             text log
``/thinned``                rule by which not every step is kept, and
                            how many were left out up to each one
``/health/NAME``            what `Recording.state` is given
``/closed``                 how many samples there are, once all are
==========================  ==========================================  ===================

Timelines: ``sim_time`` and ``step``. A recording of unknown length has no index, so that it takes
no memory; ``rerun rrd verify`` then asks for one, and ``rerun rrd optimize`` adds it. Writing and
reading files sends no analytics; Rerun's viewer does, until ``rerun analytics disable`` has been
run once.
"""

import os

# Rerun reads this when it is imported. It would warn of every file without an index.
os.environ.setdefault("RUST_LOG", "warn,re_log_encoding::rrd::file_sink=error")
# So does its allocator, which by default keeps freed pages for later: 10 MB more in a recorder.
os.environ.setdefault("MIMALLOC_PURGE_DELAY", "0")

from ab_sim.recording.reader import RecordedRun, read_recording  # noqa: E402
from ab_sim.recording.shown import drawable  # noqa: E402
from ab_sim.recording.stored import (  # noqa: E402
    BLOCK_ROWS,
    Event,
    Extent,
    StoredRun,
    open_recording,
)
from ab_sim.recording.thinning import AROUND  # noqa: E402
from ab_sim.recording.writer import BATCH_ROWS, CHUNK_ROWS, Recording  # noqa: E402

__all__ = [
    "AROUND",
    "BATCH_ROWS",
    "BLOCK_ROWS",
    "CHUNK_ROWS",
    "Event",
    "Extent",
    "RecordedRun",
    "Recording",
    "StoredRun",
    "open_recording",
    "drawable",
    "read_recording",
]
