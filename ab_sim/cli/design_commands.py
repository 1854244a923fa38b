"""Commands that decide over many drives."""

from pathlib import Path
from typing import Annotated

import typer

from ab_sim.cli.options import JsonOption, SceneArgument, SetOption

design_commands = typer.Typer()

WorkersOption = Annotated[
    int | None,
    typer.Option(
        metavar="N", help="Processes that share the work. Default: as many as processors."
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


@design_commands.command()
def sweep(
    scene: SceneArgument,
    over: Annotated[
        list[str],
        typer.Option(
            metavar="KEY=VALUES",
            help="A key that varies: KEY=FROM..TO:COUNT, KEY=log:FROM..TO:COUNT (logarithmic "
            "steps), KEY=V,V,... or, of a design, KEY=FROM..TO. Any key of the scene, SI. "
            "Repeatable: runs are all combinations.",
        ),
    ],
    change: SetOption = None,
    design: Annotated[
        str | None,
        typer.Option(
            metavar="sobol:N|lhs:N",
            help="N points that fill the ranges, instead of a grid: a scrambled Sobol sequence "
            "(N a power of 2) or a Latin hypercube.",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of a design's random numbers.")] = 0,
    merits: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,NAME,...",
            help="What runs are judged by; `ab-sim merits` lists them. Default: final_whirl_over_e,"
            " in_band_from, peak_whirl_over_e, residual_unbalance.",
        ),
    ] = None,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    json: JsonOption = None,
    parquet: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write a row for each run, with units and the scene."),
    ] = None,
    csv: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the rows as CSV.")] = None,
    plot: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Draw the merits over one key, as maps over two, or runs over pairs of more.",
        ),
    ] = None,
) -> None:
    """Run a scene over values of its keys, and judge each run by merits.

    What is done is kept: killed at any time, the same command goes on where it was; given again, it
    has its answer at once. Results do not depend on the number of processes,
    nor on their machines.

    A row has the run's number, the keys' values, the merits, `outcome` (settled; still changing,
    where the final whirl still rises or falls; circulates, where balls go round the race; failed)
    and, of a run that failed, `failure`: why. It leaves the others alone, and its merits are null.
    Whirls are in e [m] of the run, all else in SI units. The JSON has the rows by column in `runs`,
    `units`, `points`, which the values follow from, `outcomes`, and the `scene`.

    `ab_sim.open_sweep("FILE.parquet")` gives the result back; pandas, polars and DuckDB read the
    file as it is.
    """
    from ab_sim.cli.sweep import sweep_command

    shared, files = (workers, scheduler), (parquet, csv)
    sweep_command(scene, change or [], over, (design, seed), merits, shared, files).run(json, plot)
