"""Record a run into a Rerun file, bit for bit, with pictures that explain it; and read it back.

A run is a table of float64 *samples*: one row per integration step, one column per *channel*,
the first two being ``step`` (a whole number that grows) and ``time`` [s]. `Recording` writes the
table, `read_recording` returns exactly what was written.

==========================  ==========================================  ===================
entity                      contents                                    shown as
==========================  ==========================================  ===================
``/clock/time``             time [s] (the timeline is rounded to ns)
``/spindle/angle``          angle psi [rad, unwrapped]
``/spindle/speed``          speed, command [rad/s]                      plot
``/spindle/torque``         motor_torque [N m], with a motor            plot
``/deck/displacement``      x, y [m], inertial axes
``/deck/velocity``          vx, vy [m/s]
``/deck/acceleration``      ax, ay [m/s^2]                              plot
``/deck/accelerometer``     accelerometer_1, accelerometer_2 [m/s^2],
                            on its axes, with an accelerometer          plot
``/balls/angle``            ball_0_angle, ... [rad, from the
                            unbalance, unwrapped]
``/balls/rate``             ball_0_rate, ... [rad/s]
``/other/NAME``             any other channel
``/plot``, ``/top``         derived: W/e, degrees; the drawing, in mm   plots, two top views
``/run/NAME``               what `Recording.scalar` is given            plot
``/events/SOURCE``          what `Recording.event` is given             text log
==========================  ==========================================  ===================

Timelines: ``sim_time`` and ``step``. Writing and reading files sends no analytics; Rerun's viewer
does, until ``rerun analytics disable`` has been run once.
"""

from ab_sim.recording.reader import Event, RecordedRun, read_recording
from ab_sim.recording.writer import BATCH_ROWS, BATCH_SECONDS, CHUNK_ROWS, Recording

__all__ = [
    "BATCH_ROWS",
    "BATCH_SECONDS",
    "CHUNK_ROWS",
    "Event",
    "RecordedRun",
    "Recording",
    "read_recording",
]
