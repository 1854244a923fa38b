"""Options of commands: shared ones, and those of commands with many options."""

from pathlib import Path
from typing import Annotated

import typer

_FILES = Path(__file__).parents[1].joinpath("integrate", "steppers").glob("[a-z]*.py")
STEPPERS = ("auto", *sorted(file.stem.replace("_", "-") for file in _FILES))
"""Names of the steppers, from their files, because importing the registry would slow down --help. A
test compares them."""

SceneArgument = Annotated[
    str, typer.Argument(help="Name of a scene (see `ab-sim scenes`) or path of a YAML file.")
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Change a value of the scene, e.g. balls.mass=0.002 or "
        "effects.viscous_drag.coefficient=2, SI or with a unit, 'balls.mass=2 g'; an empty value "
        "removes the key. accuracy.angle=1e-9 [rad] or accuracy.whirl=1e-6 [e] asks for an error "
        "instead of the scene's solver: the cheapest stepper and step measured to deliver it are "
        "taken. Repeatable.",
    ),
]
JsonOption = Annotated[
    str | None,
    typer.Option(metavar="FILE|-", help="Write the result as JSON, or to standard output."),
]
ViewOption = Annotated[
    str,
    typer.Option(
        metavar="none|web|native|URL",
        help="Watch it in Rerun's viewer: in a browser, at the address that is printed; in a "
        "window; or in a viewer that runs already, rerun+http://HOST:PORT/proxy.",
    ),
]
NowOption = Annotated[
    bool,
    typer.Option("--now", help="With --view web: start at once, and do not wait for a browser."),
]
WorkersOption = Annotated[
    int | None,
    typer.Option(
        metavar="N", help="Processes that share the work. Default: as many as processors."
    ),
]

# ab-sim stability
HeldSpeedOption = Annotated[
    float | None,
    typer.Option(help="Of the spindle [rad/s], held. Default: at which the scene's profile ends."),
]
MapOption = Annotated[
    str | None,
    typer.Option(
        "--map",
        metavar="KEY=FROM:TO[:COUNT],KEY=FROM:TO[:COUNT]",
        help="Map two values of the scene, across and up, 200 of each unless told, e.g. "
        "speed=50:300,effects.suspension.damping=0.1:4.",
    ),
]
CoarseOption = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        help="Spacing of the points that a map begins with, a power of two: islands of fewer "
        "than N by N points may be missed; 1 computes every point. Default: 8.",
    ),
]
AgainstOption = Annotated[
    int | None,
    typer.Option(metavar="BALLS", help="Beside the map with so many balls, together as heavy."),
]
EachOption = Annotated[
    str | None,
    typer.Option(
        metavar="KEY=V,V,...",
        help="A map for each of these values of another key, e.g. "
        "effects.viscous_drag.coefficient=0.1,0.2,0.4; drawn as borders in one picture.",
    ),
]
BasinOption = Annotated[
    int | None,
    typer.Option(
        metavar="N", help="Run the scene from N by N start angles of its first two balls."
    ),
]
MapPlotOption = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Draw the map: .png, .svg or .pdf.")
]

# ab-sim run
TimesOption = Annotated[
    str | None,
    typer.Option(
        metavar="T,T,...",
        help="When to take samples [s], e.g. 2.5,3,6; the run goes on to the last of them. "
        "Default: 101 times, evenly spaced over the scene's duration.",
    ),
]
StepperOption = Annotated[
    str | None, typer.Option(help=f"Stepper instead of the scene's: {', '.join(STEPPERS)}.")
]
StepOption = Annotated[float | None, typer.Option(help="Step instead of the scene's [s].")]
RunJsonOption = Annotated[
    str | None,
    typer.Option(
        metavar="FILE|-",
        help="Write the result as JSON, SI units, to a .json file or to standard output.",
    ),
]
RunPlotOption = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Draw speed, W/e, driving force, ball angles, motor torque: .png, .svg or .pdf.",
    ),
]
RunRecordingOption = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Write a Rerun recording of every step: .rrd."),
]
ThinningOption = Annotated[
    int,
    typer.Option(
        min=1,
        help="Keep one step of so many in the recording, and all of them where the command "
        "begins or ceases to move.",
    ),
]

# ab-sim export
ParquetOption = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Write an Apache Parquet file: .parquet.")
]
CsvOption = Annotated[Path | None, typer.Option(metavar="FILE", help="Write a table: .csv.")]
McapOption = Annotated[
    Path | None, typer.Option(metavar="FOLDER", help="Write a ROS 2 bag (rosbag2, MCAP).")
]
BeginOption = Annotated[
    float, typer.Option("--from", metavar="T", help="Samples from this time on [s].")
]
EndOption = Annotated[float, typer.Option("--to", metavar="T", help="Samples until this time [s].")]
EveryOption = Annotated[
    int, typer.Option(metavar="N", help="One of every N samples, beginning with the first.")
]
ChannelsOption = Annotated[
    str | None,
    typer.Option(metavar="NAME,NAME,...", help="Only these channels, in this order. Default: all."),
]
BagNamespaceOption = Annotated[
    str | None,
    typer.Option(metavar="NAME", help="Of the drive in the bag, e.g. /left. Default: none."),
]
BagRateOption = Annotated[
    float | None,
    typer.Option(
        help="Messages of the state a second in the bag; vibration/block has all samples "
        "anyway. Default: 250, as a drive publishes."
    ),
]
SchedulerOption = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Of a Dask cluster whose workers share the work instead: HOST:PORT, tcp://HOST:PORT "
        "or tls://HOST:PORT. They need this very ab_sim.",
    ),
]
