"""Commands for recordings, measurements and ROS 2 bags."""

import math
from pathlib import Path
from typing import Annotated, NamedTuple

from typer import Argument, Option

from ab_sim.cli.declare import (
    Bag,
    Changes,
    Heading,
    Json,
    Namespace,
    Plot,
    Recording,
    SceneName,
    Seed,
    Workers,
)

recordings_and_measurements = Heading("Recordings and measurements")
nodes_and_bags = Heading("ROS nodes and bags")


@recordings_and_measurements.declare("ab_sim.cli.recordings:report_command")
class ReportOptions(NamedTuple):
    """Judge recorded runs side by side: table, picture or web page.

    Shows speed, whirl, driving force, ball angles, tilt and motor torque over time, if recorded;
    the deck's path, of the whole run and of the last turns; the spectrum of the vibration at the
    end; and its amplitude over frequency and spindle speed. Curves keep every peak. Recordings may
    have any length; the readable part of unfinished ones is used.

    Symbols, signs and angles: docs/conventions.md

    Parameters
    ----------
    recordings FILE...
        Recordings of runs: .rrd; several are shown side by side.
    png FILE
        Draw all figures in one picture: .png.
    html FILE
        Write a self-contained web page with zoomable figures: .html.
    """

    recordings: Annotated[list[Path], Argument()]
    png: Path | None = None
    html: Path | None = None
    json: Json = None


@recordings_and_measurements.declare("ab_sim.cli.recordings:compare_command")
class CompareOptions(NamedTuple):
    """Run a recording's commands again, and compare each channel.

    A recording made by ab_sim is repeated step by step, with its own scene:

    * An offline run is bit-identical, and so is a live run under the scene's profile or under speed
      commands.
    * A live run along another spindle/trajectory is repeated with the recorded speed at each step,
      and is not bit-identical.
    * A recording that begins in the middle of a run is repeated from the state of its first sample.

    Other recordings are aligned by time: the run begins at the first sample, applies each command
    from its recorded time on, and is interpolated at the recorded times. They need the channels
    step, time and command, and at least one other channel of the scene.

    Symbols, signs and angles: docs/conventions.md

    Parameters
    ----------
    plot
        Draw recorded and simulated channels, and their difference: .png, .svg or .pdf.
    """

    recording: Recording
    scene: SceneName
    change: Changes = []
    json: Json = None
    plot: Plot = None


@recordings_and_measurements.declare("ab_sim.cli.identify:identify_command")
class IdentifyOptions(NamedTuple):
    """Fit a drive's parameters to recorded vibration and speed.

    The fit has three stages:

    1. Fit recordings without balls.
    2. Find the balls' start angles, from many random starts on a growing part of each recording.
    3. Fit all values together.

    Every value has a 95 % interval. Values that no recording can determine, such as stiffness and
    mass separately, are named, and keep the scene's value. The verdict states whether the scene
    fits, and otherwise names a missing effect that would explain the residuals.

    The same seed gives the same result with any number of --workers. Worker processes are started
    for long searches only. After Ctrl-C, the command reports the best values so far, marked as
    interrupted. `ab-sim robust --spread-from` reads the JSON.

    Exit codes: 0 done (with any verdict), 2 bad input, 130 interrupted.

    Parameters
    ----------
    recordings FILE...
        Recordings of the drive: .rrd, .csv, .parquet, or a ROS bag's folder.
    scene SCENE
        Scene to start from: the drive as far as it is known.
    fit KEY,KEY,...
        Keys of the scene to fit, e.g. rotor.eccentricity.
    bounds KEY=LOW..HIGH
        Search range of a key. Default: a tenth to ten times the scene's value. Repeatable.
    without_balls FILE
        Further recording, made without balls. Not needed for recordings of ab_sim, whose scene has
        the number of balls. Repeatable.
    hold_out FILE
        Recording that is not fitted but predicted, to test the fit. Repeatable.
    map FILE
        Meanings of the columns of .csv and .parquet files, as YAML: one file for all recordings, or
        one for each in their order.
    signal displacement|acceleration|SENSOR
        Signal to fit in recordings of ab_sim. Default: the readings of the first sensor, else the
        deck's displacement.
    free gain,bias,delay,disc_angle
        Unknowns to fit for each recording, in addition to --fit: gain, bias and delay of its
        signals, and the angle of its unbalance at the zero of the spindle's angle.
    trial_mass NAME=MASS
        Mass clamped to the deck for a recording, e.g. 'run-2=5 g'; it determines the deck's mass.
        Repeatable.
    hold_open
        Keep the scene's numbers for values that the recordings cannot determine, or fit them
        nevertheless.
    out FILE
        Write the fitted scene: .yaml.
    html FILE
        Write the result as a self-contained web page: .html.
    plot
        Draw measured and fitted signals: .png, .svg or .pdf.
    """

    recordings: Annotated[list[Path], Argument()]
    scene: Annotated[str, Option()]
    fit: str
    change: Changes = []
    bounds: list[str] = []
    without_balls: list[Path] = []
    hold_out: list[Path] = []
    map: list[Path] = []
    signal: str | None = None
    free: str | None = None
    trial_mass: list[str] = []
    seed: Seed = 0
    hold_open: Annotated[bool, Option("--hold-open/--fit-open")] = True
    workers: Workers = None
    out: Path | None = None
    html: Path | None = None
    json: Json = None
    plot: Plot = None


@recordings_and_measurements.declare("ab_sim.cli.bags:export_command")
class ExportOptions(NamedTuple):
    """Convert a recording to Parquet, CSV or a ROS 2 bag.

    Recordings may have any length; the readable part of unfinished ones is used.

    In a table, each channel is a column:

    * Parquet has the unit in the column's metadata, as `unit`, and the scene as JSON in the file's
      metadata, as `ab_sim`. CSV has the unit in the header, as `x [m]`.
    * The computed column `whirl` [m] is the distance of the deck's centre from its rest position,
      across the shaft's axis. Frames and signs: docs/conventions.md

    A bag has the whole recording, as the messages that a live drive publishes, stamped with
    simulated time:

    * Topics: every sample in vibration/block; the state in joint_states, vibration, whirl and
      deck_pose; commands; the profile controller's state; events on /rosout.
    * Foxglove and PlotJuggler open the .mcap file in the folder; `ros2 bag` opens the folder.
    * `ab-sim import` converts the bag back to the same recording.

    Parameters
    ----------
    parquet FILE
        Write a table as an Apache Parquet file: .parquet.
    csv FILE
        Write a table as text: .csv.
    mcap FOLDER
        Write a ROS 2 bag (rosbag2, MCAP) as a new folder.
    begin --from T
        Time of the first sample [s].
    end --to T
        Time of the last sample [s].
    every N
        Write only every Nth sample, beginning with the first.
    channels NAME,NAME,...
        Channels to write, in this order. Default: all.
    namespace NAME
        ROS namespace of the drive in the bag, e.g. /left. Default: none.
    rate HZ
        Rate of the state's messages in the bag [Hz]; vibration/block has all samples at any rate.
        Default: 250, the rate of a live drive.
    """

    recording: Recording
    parquet: Path | None = None
    csv: Path | None = None
    mcap: Path | None = None
    begin: float = -math.inf
    end: float = math.inf
    every: int = 1
    channels: str | None = None
    namespace: str | None = None
    rate: float | None = None


@recordings_and_measurements.declare("ab_sim.cli.recordings:print_state")
class StateOptions(NamedTuple):
    """Print a recorded state as the section `start` of a scene.

    A run can continue from this state, also in another scene with the same number of balls:
    `ab-sim run my-scene.yaml --set "start=$(ab-sim state run.rrd)"`. The state does not say which
    balls are held by friction, and has no integral of a motor's speed loop and no states of sensor
    filters.

    Parameters
    ----------
    time --at T
        Time of the state [s]. Default: the end of the recording.
    """

    recording: Recording
    time: float | None = None


@nodes_and_bags.declare("ab_sim.cli.bags:import_command")
class ImportOptions(NamedTuple):
    """Convert a ROS 2 bag to a recording.

    If the bag has vibration/block, the recording is bit-identical to the recorder's. Otherwise it
    is made from spindle/command, joint_states, vibration, whirl, imu/data_raw and displacement,
    as far as the bag has them. It then has a row for each stamp of the sensor with the most
    samples; if positions are unknown, it has plots, but no drawing. The readable part of an
    unfinished bag is used. If the drive was reset, there are several recordings: FILE, FILE-2 and
    so on.

    Parameters
    ----------
    out FILE
        Recording to write: .rrd. Default: the bag's name, in this folder.
    """

    bag: Bag
    out: Path | None = None
    namespace: Namespace = None


@nodes_and_bags.declare("ab_sim.cli.replay:replay_command")
class ReplayOptions(NamedTuple):
    """Publish a ROS 2 bag again, with its timing and QoS.

    Commands are included: a drive that subscribes to spindle/command obeys them. drive_description
    is published first. A recorder of these topics gets the same samples again.

    Parameters
    ----------
    rate FACTOR
        Playback speed factor; 2 is twice as fast as recorded.
    start_paused
        Begin only when the ROS service replay/pause is called with false.
    """

    bag: Bag
    rate: float = 1.0
    namespace: Namespace = None
    start_paused: Annotated[bool, Option("--start-paused")] = False


@nodes_and_bags.declare("ab_sim.cli.replay:repair_command")
class RepairOptions(NamedTuple):
    """Repair a ROS 2 bag whose recorder was killed, in place.

    All complete messages are kept unchanged. The bag gets the index and the counts that other
    programs need. A new file is written next to the old one, and replaces it when it is complete. A
    bag that is still being written is refused.
    """

    bag: Bag


@nodes_and_bags.declare("ab_sim.cli.c:print_urdf")
class UrdfOptions(NamedTuple):
    """Print a scene as a URDF, for robot_state_publisher.

    `drive_sim` publishes this text on the topic robot_description, for RViz, and the deck's pose on
    tf. Joints have the same names as in joint_states.

    Parameters
    ----------
    ros2_control
        Also print limits of the spindle's joint, and the element <ros2_control> for topic-based
        hardware.
    """

    scene: SceneName
    change: Changes = []
    ros2_control: Annotated[bool, Option("--ros2-control")] = False
