"""Arguments and options that several commands share, each with its help."""

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

_FILES = Path(__file__).parents[1].joinpath("engine", "integrate", "steppers").glob("[a-z]*.py")
STEPPERS = ("auto", *sorted(file.stem.replace("_", "-") for file in _FILES))
"""Names of the steppers, from their files, because importing the registry would slow down --help. A
test compares them."""

SceneName = Annotated[
    str,
    Argument(
        help="Scene, the description of a drive and its run: a name from `ab-sim scenes`, or a "
        "YAML file."
    ),
]
Recording = Annotated[
    Path, Argument(metavar="FILE", help="Recording of a run, e.g. by `ab-sim run --rrd`: .rrd.")
]
Bag = Annotated[
    Path, Argument(metavar="BAG", help="ROS 2 bag: its folder, or its .mcap or .db3 file.")
]
Changes = Annotated[
    list[str],
    Option(
        "--set",
        metavar="KEY=VALUE",
        help="Change a key of the scene, e.g. balls.mass=0.002 (SI units) or 'balls.mass=2 g'. "
        "An empty value removes the key. accuracy.angle=1e-9 (error of ball angles [rad]) or "
        "accuracy.whirl=1e-6 (error of the whirl [e], in eccentricities) chooses the cheapest "
        "stepper and step with at most this error. Repeatable.",
    ),
]
Speed = Annotated[
    float | None,
    Option(
        metavar="SPEED",
        help="Constant spindle speed [rad/s]. Default: the final speed of the scene's profile.",
    ),
]
Json = Annotated[
    str | None,
    Option(metavar="FILE|-", help="Write the result as JSON: .json, or - for standard output."),
]
ListJson = Annotated[bool, Option("--json", help="Print the list as JSON.")]
Plot = Annotated[Path | None, Option(metavar="FILE", help="Draw the result: .png, .svg or .pdf.")]
Parquet = Annotated[
    Path | None, Option(metavar="FILE", help="Write a table with a row for each run: .parquet.")
]
Csv = Annotated[
    Path | None, Option(metavar="FILE", help="Write a table with a row for each run: .csv.")
]
Units = Annotated[
    str,
    Option(
        metavar="UNIT,UNIT,...",
        help="Units of tables and pictures, e.g. 'rpm,g mm,deg'; files keep SI units.",
    ),
]
Seed = Annotated[
    int,
    Option(
        metavar="N", min=0, help="Seed of the random numbers; the same seed repeats the result."
    ),
]
Workers = Annotated[
    int | None,
    Option(metavar="N", help="Number of parallel processes. Default: the number of processors."),
]
Scheduler = Annotated[
    str | None,
    Option(
        metavar="ADDRESS",
        help="Address of a Dask cluster to use instead of local processes: HOST:PORT, "
        "tcp://HOST:PORT or tls://HOST:PORT. Its workers need the same version of ab_sim.",
    ),
]
Repeats = Annotated[
    int,
    Option(metavar="N", help="Number of measurements of each time; their median is reported."),
]
Quartiles = Annotated[
    bool, Option("--quartiles", help="Also show the quartiles of the times, in a wider table.")
]
View = Annotated[
    str,
    Option(
        metavar="none|web|native|URL",
        help="Watch the run in Rerun's viewer: in a browser (web), in a window (native), or in a "
        "running viewer at rerun+http://HOST:PORT/proxy.",
    ),
]
Now = Annotated[bool, Option("--now", help="With --view web: start without waiting for a browser.")]
Namespace = Annotated[
    str | None,
    Option(
        metavar="NAME",
        help="ROS namespace of the drive, if the bag has several drives, e.g. /left.",
    ),
]
