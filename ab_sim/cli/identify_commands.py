"""`ab-sim identify` and its options."""

from pathlib import Path
from typing import Annotated

import typer

from ab_sim.cli.options import JsonOption, SetOption, WorkersOption

identify_commands = typer.Typer()


@identify_commands.command()
def identify(
    recordings: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE...",
            help="Recordings of the drive: .rrd, .csv, .parquet, or a ROS bag's folder.",
        ),
    ],
    scene: Annotated[
        str, typer.Option(metavar="SCENE", help="Where to begin: the drive as far as it is known.")
    ],
    fit: Annotated[
        str,
        typer.Option(
            metavar="KEY,KEY,...",
            help="Keys of the scene to be fitted, e.g. rotor.eccentricity,balls.mass.",
        ),
    ],
    change: SetOption = None,
    bounds: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=LOW..HIGH",
            help="Where a key is looked for. Default: within a factor of 10. Repeatable.",
        ),
    ] = None,
    without_balls: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="A further recording, made without the balls; ab_sim's own say so themselves. "
            "Repeatable.",
        ),
    ] = None,
    hold_out: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE", help="A recording that is not fitted, but judged. Repeatable."
        ),
    ] = None,
    map_file: Annotated[
        list[Path] | None,
        typer.Option(
            "--map",
            metavar="FILE",
            help="What the columns of .csv and .parquet files are, YAML: one for all, or one for "
            "each recording in their order.",
        ),
    ] = None,
    signal: Annotated[
        str | None,
        typer.Option(
            metavar="displacement|acceleration|SENSOR",
            help="Of ab_sim's own recordings: what is fitted. Default: the first sensor's "
            "readings, else the deck's displacement.",
        ),
    ] = None,
    free: Annotated[
        str | None,
        typer.Option(
            metavar="gain,bias,delay,disc_angle",
            help="What else of each recording is not known, and fitted.",
        ),
    ] = None,
    trial_mass: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=MASS",
            help="A mass that was clamped to the deck for a recording, e.g. 'run-2=5 g': it tells "
            "the deck's mass. Repeatable.",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the random starts.")] = 0,
    hold_open: Annotated[
        bool,
        typer.Option(
            "--hold-open/--fit-open", help="Whether what the recordings cannot tell is held."
        ),
    ] = True,
    workers: WorkersOption = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the fitted scene, to run: .yaml.")
    ] = None,
    html: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write a page that needs nothing else: .html."),
    ] = None,
    json: JsonOption = None,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw measured beside fitted: .png, .svg or .pdf."),
    ] = None,
) -> None:
    """Fit a drive's parameters to recorded vibration and speed.

    Recordings without balls are fitted first, then start angles of the balls from many random
    starts on a growing part of each recording, then everything at once. Every number has its
    interval of 95 %. What no recording can tell, as stiffness and mass apart, is named, and held at
    the scene's value. The verdict says whether the scene fits, whether something is missing in it,
    and which effect would explain that.

    The same seed gives the same answer, with any number of --workers; these are started where the
    search takes long. Ctrl-C gives the best so far, marked as such.

    The JSON has `verdict`, `reasons`, `parameters` (name, unit, value, low, high, deviation, how,
    at_bound, start, own; an infinite end is null), `covariance`, `correlation`, `profiles`,
    `knowledge` (singular values, what is open), `residuals`, `tried_effects`, `held_out`,
    `next_recordings`, `notes`, `runs`, `seed` and the `fitted_scene`. `ab-sim robust` takes it by
    --spread-from.

    Exit codes: 0 done, whatever the verdict, 2 bad input, 130 interrupted.
    """
    from ab_sim.cli.identify import IdentifyOptions, identify_command

    given = IdentifyOptions(
        recordings, without_balls or [], hold_out or [], map_file or [], fit, bounds or [], signal,
        free, trial_mass or [], seed, hold_open, workers, out, html,
    )  # fmt: skip
    identify_command(scene, change or [], given).run(json, plot)
