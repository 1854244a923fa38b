"""Commands for recordings: view, convert, repeat."""

from pathlib import Path
from typing import Annotated

import typer

from ab_sim.cli.options import (
    BagNamespaceOption,
    BagRateOption,
    BeginOption,
    ChannelsOption,
    CsvOption,
    EndOption,
    EveryOption,
    JsonOption,
    McapOption,
    ParquetOption,
    SceneArgument,
    SetOption,
)
from ab_sim.errors import InputError

recording_commands = typer.Typer()

RecordingArgument = Annotated[Path, typer.Argument(help="A recording: .rrd.", metavar="FILE")]


@recording_commands.command()
def export(
    recording: RecordingArgument,
    parquet: ParquetOption = None,
    csv: CsvOption = None,
    mcap: McapOption = None,
    begin: BeginOption = float("-inf"),
    end: EndOption = float("inf"),
    every: EveryOption = 1,
    channels: ChannelsOption = None,
    namespace: BagNamespaceOption = None,
    rate: BagRateOption = None,
) -> None:
    """Convert a recording to Parquet, CSV or a ROS 2 bag.

    Each channel is a column, with its unit: in Parquet in the column's metadata, as `unit`, in CSV
    in the header, as `x [m]`. A Parquet file has what was run, JSON, in its own metadata as
    `ab_sim`. `whirl` [m], which is not recorded, is written as well: how far the deck's centre is,
    across the shaft's axis, from where it hangs at rest (frames and signs: docs/conventions.md).
    Recordings of any length are read in blocks; the readable part of unfinished ones is used.

    A bag has the whole of it, as the messages that a live drive publishes, stamped with simulated
    time: every sample in vibration/block, the state in joint_states, vibration, whirl and
    deck_pose, commands, the profile controller's state, events on /rosout. Foxglove and PlotJuggler
    open the .mcap file in the folder, `ros2 bag` the folder; `ab-sim import` makes the same
    recording of it.
    """
    from ab_sim.cli.export import export_command
    from ab_sim.recording.export import Part

    names = None if channels is None else tuple(name.strip() for name in channels.split(","))
    part = Part(begin, end, every, names)
    if mcap is None and not (namespace is None and rate is None):
        raise InputError("--namespace, --rate: go with --mcap, as they are of the bag")
    if mcap is not None:
        from ab_sim.cli.bags import export_bag_command

        export_bag_command(recording, mcap, namespace or "/", rate, part)
    if mcap is None or parquet is not None or csv is not None:
        export_command(recording, parquet, csv, part).run()


@recording_commands.command()
def state(
    recording: RecordingArgument,
    time: Annotated[
        float | None,
        typer.Option("--at", metavar="T", help="At this time [s]. Default: its end."),
    ] = None,
) -> None:
    """Print a recorded state as the section `start` of a scene.

    A run goes on from there, also in another scene with as many balls:
    `ab-sim run my-scene.yaml --set "start=$(ab-sim state run.rrd)"`. A sample does not show whether
    friction holds balls, and what a motor's speed loop and filters of sensors remember.
    """
    from ab_sim.cli.state import state_command

    state_command(recording, time)


@recording_commands.command()
def compare(
    recording: RecordingArgument,
    scene: SceneArgument,
    change: SetOption = None,
    json: JsonOption = None,
    plot: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Draw recorded, simulated, difference: .png, .svg or .pdf."
        ),
    ] = None,
) -> None:
    """Run a recording's commands again, and compare each channel.

    A recording of ab_sim is followed step by step, and with its own scene gives the same bits, run
    live or offline. Another one is aligned by time: the scene begins at its first sample, obeys
    each command from its time on, and is interpolated at the recorded times. It needs the channels
    step, time and command, and one more that the scene has, too. One that begins in the middle of
    a run is followed from the state of its first sample.

    The JSON has `channels`, each with channel, unit, largest (difference), at (when [s]), rms,
    largest_relative and rms_relative (in the range of what was recorded, recorded_from to
    recorded_to), same_to_the_bit, and compared (samples); `not_compared`, each of the other
    channels with its reason; `driven_by`, `aligned`, `samples`, `duration`, `same_to_the_bit` (of
    all that were compared) and `notes`. Symbols, signs and angles: docs/conventions.md
    """
    from ab_sim.cli.compare import compare_command

    compare_command(recording, scene, change or []).run(json, plot)


@recording_commands.command()
def report(
    recordings: Annotated[
        list[Path], typer.Argument(help="Recordings: .rrd; several stand side by side.")
    ],
    png: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the runs into a picture: .png.")
    ] = None,
    html: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Write one page with figures to zoom, which needs nothing else: .html.",
        ),
    ] = None,
    json: JsonOption = None,
) -> None:
    """Judge recorded runs side by side: table, picture or web page.

    Speed, whirl, driving force, ball angles, tilt and motor torque over time, as far as there are;
    the deck's path, of the whole run and of the last turns; the spectrum of the vibration at the
    end; and its amplitude over frequency and spindle speed. Curves hold every peak. Recordings of
    any length are read in blocks; the readable part of unfinished ones is used.

    The JSON has `runs`, each with recording, scene, begins and duration [s], samples, gaps,
    missing, complete, events, merits (see `ab-sim merits`; null if what was run is not known),
    vibration_of, vibration_rms [m/s^2], once_per_turn_share, real_time_factor (mean, least; null of
    an offline run) and notes. Symbols, signs and angles: docs/conventions.md
    """
    from ab_sim.cli.report import report_command

    report_command(recordings, png, html).run(json)
