"""Options of the commands that decide over many drives."""

from pathlib import Path
from typing import Annotated

import typer

UnitsOption = Annotated[
    str,
    typer.Option(
        metavar="UNIT,UNIT,...",
        help="Show tables and pictures in these units where they fit, e.g. 'rpm,g mm,deg'; files "
        "stay in SI.",
    ),
]

# ab-sim sweep
SweepOverOption = Annotated[
    list[str],
    typer.Option(
        metavar="KEY=VALUES",
        help="A key that varies: KEY=FROM..TO:COUNT, KEY=log:FROM..TO:COUNT (logarithmic "
        "steps), KEY=V,V,... or, of a design, KEY=FROM..TO. Any key of the scene, in SI or with "
        "units. Repeatable: runs are all combinations.",
    ),
]
SweepDesignOption = Annotated[
    str | None,
    typer.Option(
        metavar="sobol:N|lhs:N",
        help="N points that fill the ranges, instead of a grid: a scrambled Sobol sequence "
        "(N a power of 2) or a Latin hypercube.",
    ),
]
SweepSeedOption = Annotated[int, typer.Option(min=0, help="Of a design's random numbers.")]
SweepMeritsOption = Annotated[
    str | None,
    typer.Option(
        metavar="NAME,NAME,...",
        help="What runs are judged by; `ab-sim merits` lists them. Default: final_whirl_over_e,"
        " in_band_from, peak_whirl_over_e, residual_unbalance.",
    ),
]
SweepParquetOption = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Write a row for each run, with units and the scene."),
]
SweepCsvOption = Annotated[Path | None, typer.Option(metavar="FILE", help="Write the rows as CSV.")]
SweepPlotOption = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Draw the merits over one key, as maps over two, or runs over pairs of more.",
    ),
]

# ab-sim tune
TuneVaryOption = Annotated[
    list[str],
    typer.Option(
        metavar="KEY=FROM..TO",
        help="A key that may be chosen, and its range; KEY=log:FROM..TO over orders of "
        "magnitude. Keys that take whole numbers, as balls.count, stay whole. Repeatable.",
    ),
]
TuneMinimiseOption = Annotated[
    str | None,
    typer.Option(metavar="MERIT", help="What is to be small; `ab-sim merits` lists merits."),
]
TuneMaximiseOption = Annotated[
    str | None, typer.Option(metavar="MERIT", help="What is to be large, instead.")
]
TuneSubjectToOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="BOUND",
        help="What else must hold: 'final_whirl_over_e<0.2', balanced, 'not balls_circulate'. "
        "Repeatable.",
    ),
]
TuneSpreadOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="KEY=SPREAD",
        help="How built drives differ, as of `ab-sim robust`, e.g. balls.mass=5%. Repeatable. "
        "What counts is then what most drives reach, not what the drawing does.",
    ),
]
TuneDrawsOption = Annotated[
    int, typer.Option(min=2, help="Of spread drives: of each candidate, the same of all.")
]
TuneShareOption = Annotated[
    str, typer.Option(metavar="90%", help="Of spread drives: that have to be so good.")
]
TuneRunsOption = Annotated[int, typer.Option(metavar="N", help="At most about so many runs.")]
TuneSeedOption = Annotated[int, typer.Option(min=0, help="Of the search's random numbers.")]
TuneBestSceneOption = Annotated[
    Path | None,
    typer.Option("--scene", metavar="FILE", help="Write the best scene, to run: .yaml."),
]
TuneParquetOption = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Write a row for each run looked at.")
]
TunePlotOption = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Draw the landscape that it saw, a panel for each key."),
]

# ab-sim robust
RobustSpreadOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="KEY=SPREAD",
        help="How a key of built drives differs from the scene: 5% (normal, about the scene's "
        "value), '0.1 mm' (so, in its unit), normal:MEAN,SD, lognormal:MEDIAN,40%, "
        "uniform:LOW,HIGH, uniform:5%, discrete:V,V,...; start.ball_angles=random. Behind it: "
        "low=NUMBER, high=NUMBER (cut off there), 'per ball', group=NAME (one draw for the "
        "group). Repeatable, also of one key.",
    ),
]
RobustSpreadFromOption = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="What is not known of a fitted scene, from the JSON of `ab-sim identify`: its "
        "values, correlated as they were found. --spread acts beside it.",
    ),
]
RobustRunsOption = Annotated[int, typer.Option(min=1, help="Drives; with --until, at least.")]
RobustUntilOption = Annotated[
    str | None,
    typer.Option(
        metavar="0.1%", help="Go on until the interval of the share is +- this, in % of drives."
    ),
]
RobustBalancedOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="MERIT<NUMBER",
        help="What has to hold of a run that settled, e.g. 'residual_unbalance<=0.1'. "
        "Repeatable: all have to. Default: the merit balanced.",
    ),
]
RobustMeritsOption = Annotated[
    str | None,
    typer.Option(metavar="NAME,NAME,...", help="What there are quantiles of; default as of sweep."),
]
RobustAgainstOption = Annotated[
    str | None,
    typer.Option(metavar="SCENE", help="Another design, run with the same draws."),
]
RobustSobolOption = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        min=0,
        help="Pairs of drives, a power of 2, that Sobol indices follow from; N runs more for "
        "each spread or group. 0: none. Default: what half as many runs more pay for, "
        "none where that is fewer than 128.",
    ),
]
RobustSeedOption = Annotated[int, typer.Option(min=0, help="Of the random draws.")]
RobustWorstOption = Annotated[
    Path | None,
    typer.Option(metavar="FOLDER", help="Write the ten worst runs there, as scenes."),
]
RobustParquetOption = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Write a row for each run, as `ab-sim sweep` does."),
]
RobustPlotOption = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Draw distributions of the merits, and the Sobol indices."),
]

# ab-sim size
SizeMassOption = Annotated[
    str,
    typer.Option(metavar="'100 g'", help="All that moves on the suspension, without balls."),
]
SizeCriticalOption = Annotated[
    str, typer.Option(metavar="'100 rad/s'", help="Critical speed, without balls.")
]
SizeSpeedOption = Annotated[
    str, typer.Option(metavar="'200 rad/s'", help="Running speed, above it.")
]
SizeRaceRadiusOption = Annotated[
    str, typer.Option(metavar="'12 mm'", help="Of the wall that balls roll on, inside.")
]
SizeRaceWidthOption = Annotated[
    str, typer.Option(metavar="'4 mm'", help="Room for a ball's diameter.")
]
SizeUnbalanceOption = Annotated[
    str | None,
    typer.Option(
        metavar="'0.3 g cm'",
        help="Largest unbalance, or LEAST..LARGEST; rotors lie evenly between.",
    ),
]
SizeGradeOption = Annotated[
    str | None,
    typer.Option(metavar="G6.3", help="Instead: the grade of unbalanced rotors, ISO 21940-11."),
]
SizeDampingRatioOption = Annotated[
    float, typer.Option(help="Of the suspension: c / (2 sqrt(k M)).")
]
SizeAccelerationOption = Annotated[
    str | None, typer.Option(metavar="'40 rad/s^2'", help="Default: at speed within 1 s.")
]
SizeSettleOption = Annotated[
    str,
    typer.Option(metavar="'3 s'", help="From the running speed until it must be balanced."),
]
SizeDensityOption = Annotated[
    str, typer.Option(metavar="steel", help="Or ceramic, tungsten carbide, '7.8 g/cm^3'.")
]
SizeBallsOption = Annotated[
    str, typer.Option(metavar="2..6", help="Numbers of balls, from 2 to 12.")
]
SizeShareOption = Annotated[
    str, typer.Option(metavar="90%", help="Of drives that must be balanced by then.")
]
SizeLeftOption = Annotated[
    str, typer.Option(metavar="10%", help="Of the largest unbalance, that may be left.")
]
SizeDragToleranceOption = Annotated[
    str, typer.Option(metavar="20%", help="By which the drag of built drives is off.")
]
SizeFrictionArmOption = Annotated[
    str, typer.Option(metavar="'0.1 um'", help="Of rolling friction, which runs then have.")
]
SizeRunsOption = Annotated[int, typer.Option(metavar="N", help="Drives, to check each claim by.")]
SizeSceneOption = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Write the sized drive, to run: .yaml.")
]
SizePlotOption = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Draw drag windows, and shares predicted and seen."),
]
