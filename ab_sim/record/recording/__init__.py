"""Recording of a run in a Rerun file, bit for bit, with drawings that explain it; and its reader.

A run is a table of float64 *samples*: one row per integration step, one column per *channel*. The
first two channels are ``step`` (an increasing whole number) and ``time`` [s]. `Recording` writes
the table, and `open_recording` reads exactly what was written: as a whole, or in blocks for runs
that do not fit into memory.

======================  ===================================================  =================
entity                  contents                                             shown as
======================  ===================================================  =================
``/samples``            all channels, a component ``channels:GROUP`` for     plots, each of a
                        each group of them:                                  component
                        ``time`` [s] (the timeline is rounded to ns),
                        ``spindle_angle`` psi [rad, unwrapped],
                        ``spindle_speed``: speed, command [rad/s],
                        ``spindle_torque`` [N m], with a motor,
                        ``deck_displacement`` x, y [m], inertial axes; z of
                        a deck in space, as in the next two,
                        ``deck_velocity``, ``deck_acceleration``,
                        ``deck_turn`` qw, qx, qy, qz, of a deck in space,
                        ``deck_angular_velocity`` [rad/s], on deck axes,
                        ``deck_angular_acceleration`` [rad/s^2],
                        ``sensor_NAME`` NAME_1, ... [m/s^2], on its axes,
                        ``balls_angle`` [rad, from the unbalance, unwrapped],
                        ``balls_rate`` [rad/s], ``other_NAME`` any other;
                        derived: ``plot:whirl`` W/e, lengths of
                        accelerations ``plot:vector_lengths``; in a
                        decimated recording ``channels:left_out``, number
                        of omitted steps up to each sample
``/plot``, ``/state``   derived: r.m.s., orders and spectra of the           plots
                        vibration; state of the spindle
``/above``, ``/space``  derived: the drawings, in mm, at most 100 times a    top view, 3-D
                        second; with ``/above/rotor`` angles in degrees,     view, plots
                        driving forces, tilt
``/about``              explanation of the drawings                          text
``/run/NAME``           values of `Recording.scalar`                         plot
``/events/SOURCE``      entries of `Recording.event`                         text log
``/decimated``          rule by which steps are omitted
``/health/NAME``        values of `Recording.state`
``/closed``             number of samples, in a finished recording
======================  ===================================================  =================

Sizes of files are in docs/howto/recordings.md. Timelines: ``sim_time`` and ``step``. Files have
no index, so that recording takes no memory; ``rerun rrd verify`` reports that the index is missing,
and ``rerun rrd optimize`` adds it. Writing and reading files sends no
analytics; Rerun's viewer sends them, unless ``rerun analytics disable`` has been run once.
"""

import os

# Rerun reads this variable when it is imported. Without it, Rerun's allocator would keep freed
# pages for later use: 10 MB more in a recorder.
os.environ.setdefault("MIMALLOC_PURGE_DELAY", "0")

from ab_sim.record.recording.decimation import AROUND  # noqa: E402
from ab_sim.record.recording.layout import LEFT_OUT  # noqa: E402
from ab_sim.record.recording.stored import (  # noqa: E402
    BLOCK_ROWS,
    Event,
    Extent,
    StoredRun,
    open_recording,
)
from ab_sim.record.recording.views import drawable  # noqa: E402
from ab_sim.record.recording.writer import BATCH_ROWS, CHUNK_ROWS, SHOWN_PERIOD, Recording  # noqa: E402

__all__ = [
    "AROUND",
    "BATCH_ROWS",
    "BLOCK_ROWS",
    "CHUNK_ROWS",
    "Event",
    "Extent",
    "LEFT_OUT",
    "Recording",
    "SHOWN_PERIOD",
    "StoredRun",
    "open_recording",
    "drawable",
]
