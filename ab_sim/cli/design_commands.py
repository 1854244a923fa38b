"""Commands that decide over many drives."""

from pathlib import Path
from typing import Annotated

import typer

from ab_sim.cli.options import JsonOption, SceneArgument, SchedulerOption, SetOption, WorkersOption

design_commands = typer.Typer()


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


@design_commands.command()
def tune(
    scene: SceneArgument,
    vary: Annotated[
        list[str],
        typer.Option(
            metavar="KEY=FROM..TO",
            help="A key that may be chosen, and its range; KEY=log:FROM..TO over orders of "
            "magnitude. Keys that take whole numbers, as balls.count, stay whole. Repeatable.",
        ),
    ],
    change: SetOption = None,
    minimise: Annotated[
        str | None,
        typer.Option(metavar="MERIT", help="What is to be small; `ab-sim merits` lists merits."),
    ] = None,
    maximise: Annotated[
        str | None, typer.Option(metavar="MERIT", help="What is to be large, instead.")
    ] = None,
    subject_to: Annotated[
        list[str] | None,
        typer.Option(
            metavar="BOUND",
            help="What else must hold: 'final_whirl_over_e<0.2', balanced, 'not still_changing'. "
            "Repeatable.",
        ),
    ] = None,
    spread: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=SPREAD",
            help="How built drives differ, as of `ab-sim robust`, e.g. balls.mass=5%. Repeatable. "
            "What counts is then what most drives reach, not what the drawing does.",
        ),
    ] = None,
    draws: Annotated[
        int, typer.Option(min=2, help="Of spread drives: of each candidate, the same of all.")
    ] = 32,
    share: Annotated[
        str, typer.Option(metavar="90%", help="Of spread drives: that have to be so good.")
    ] = "90%",
    runs: Annotated[int, typer.Option(metavar="N", help="At most about so many runs.")] = 1000,
    seed: Annotated[int, typer.Option(min=0, help="Of the search's random numbers.")] = 0,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    json: JsonOption = None,
    best_scene: Annotated[
        Path | None,
        typer.Option("--scene", metavar="FILE", help="Write the best scene, to run: .yaml."),
    ] = None,
    parquet: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write a row for each run looked at.")
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw the landscape that it saw, a panel for each key."),
    ] = None,
) -> None:
    """Find the values of keys with which a merit is best, within bounds on others.

    First by differential evolution over the whole ranges, then near the best that it has found
    (Nelder and Mead). Only runs that settled count: that did not fail, whose balls do not circulate
    and whose whirl does not still rise or fall. Where no run settled within all bounds it says so,
    with exit code 1, and names no best.

    It shows the best values; the merit there, for the scene as it is, without its variable-speed
    period, and with each key 5 % less and more; and which ends of ranges and bounds the best is at.
    With --spread all of that is what a share of the drives reaches, each candidate having the same
    draws; the candidates are then --runs over --draws.
    The JSON has `found`, `values`, `best`, `active`, `beside`, `before`, the best `scene`, and all
    `runs` by column.

    The same seed gives the same answer. What is done is kept: killed at any time, the same command
    goes on where it was.
    """
    from ab_sim.cli.tune import Wanted, tune_command

    wanted = Wanted(
        vary, minimise, maximise, subject_to or [], spread or [], draws, share, runs, seed
    )
    shared, files = (workers, scheduler), (best_scene, parquet)
    tune_command(scene, change or [], wanted, shared, files).run(json, plot)


@design_commands.command()
def robust(
    scene: SceneArgument,
    spread: Annotated[
        list[str],
        typer.Option(
            metavar="KEY=SPREAD",
            help="How a key of built drives differs from the scene: 5% (normal, about the scene's "
            "value), '0.1 mm' (so, in its unit), normal:MEAN,SD, lognormal:MEDIAN,40%, "
            "uniform:LOW,HIGH, uniform:5%, discrete:V,V,...; start.ball_angles=random. Behind it: "
            "low=NUMBER, high=NUMBER (cut off there), 'per ball', group=NAME (one draw for the "
            "group). Repeatable, also of one key.",
        ),
    ],
    change: SetOption = None,
    runs: Annotated[int, typer.Option(min=1, help="Drives; with --until, at least.")] = 10_000,
    until: Annotated[
        str | None,
        typer.Option(
            metavar="0.1%", help="Go on until the interval of the share is +- this, in % of drives."
        ),
    ] = None,
    balanced: Annotated[
        list[str] | None,
        typer.Option(
            metavar="MERIT<NUMBER",
            help="What has to hold of a run that settled, e.g. 'residual_unbalance<=0.1'. "
            "Repeatable: all have to. Default: the merit balanced.",
        ),
    ] = None,
    merits: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,NAME,...", help="What there are quantiles of; default as of sweep."
        ),
    ] = None,
    against: Annotated[
        str | None,
        typer.Option(metavar="SCENE", help="Another design, run with the same draws."),
    ] = None,
    sobol: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=0,
            help="Pairs of drives, a power of 2, that Sobol indices follow from; N runs more for "
            "each spread or group. 0: none. Default: what half as many runs more pay for.",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the random draws.")] = 0,
    worst: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Write the ten worst runs there, as scenes."),
    ] = None,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    json: JsonOption = None,
    parquet: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write a row for each run, as `ab-sim sweep` does."),
    ] = None,
    csv: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the rows as CSV.")] = None,
    plot: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Draw distributions of the merits, and the Sobol indices."
        ),
    ] = None,
) -> None:
    """Say what share of built drives balances, how good they are, which tolerance is to blame.

    Runs are independent random draws. The share has Wilson's interval, quantiles have that of order
    statistics, first-order and total Sobol indices that of a bootstrap, differences of designs are
    paired: Newcombe's interval. All are of 95 %. What the model itself gets wrong is in none.

    A draw of a run does not depend on how many there are: with more --runs, or a finer --until, the
    command goes on from what is done, which is kept, killed at any time or not. Results do not
    depend on the number of processes.

    The JSON has `share`, `quantiles` by merit, `sobol`, `worst`, `against`, the rows by column in
    `runs`, and `balanced` for each. Whirls are in e [m] of the run, all else in SI units.
    """
    from ab_sim.cli.robust import RobustOptions, robust_command

    shared = workers, scheduler
    given = RobustOptions(
        runs, seed, balanced or [], merits, sobol, until, against, shared, parquet, csv, worst
    )
    robust_command(scene, change or [], spread, given).run(json, plot)


@design_commands.command()
def size(
    mass: Annotated[
        str,
        typer.Option(metavar="'100 g'", help="All that moves on the suspension, without balls."),
    ],
    critical: Annotated[
        str, typer.Option(metavar="'100 rad/s'", help="Critical speed, without balls.")
    ],
    speed: Annotated[str, typer.Option(metavar="'200 rad/s'", help="Running speed, above it.")],
    race_radius: Annotated[
        str, typer.Option(metavar="'12 mm'", help="Of the wall that balls roll on, inside.")
    ],
    race_width: Annotated[str, typer.Option(metavar="'4 mm'", help="Room for a ball's diameter.")],
    unbalance: Annotated[
        str | None,
        typer.Option(
            metavar="'0.3 g cm'",
            help="Largest unbalance, or LEAST..LARGEST; rotors lie evenly between.",
        ),
    ] = None,
    grade: Annotated[
        str | None,
        typer.Option(metavar="G6.3", help="Instead: the grade of unbalanced rotors, ISO 21940-11."),
    ] = None,
    damping_ratio: Annotated[
        float, typer.Option(help="Of the suspension: c / (2 sqrt(k M)).")
    ] = 0.05,
    acceleration: Annotated[
        str | None, typer.Option(metavar="'40 rad/s^2'", help="Default: at speed within 1 s.")
    ] = None,
    settle: Annotated[
        str,
        typer.Option(metavar="'3 s'", help="From the running speed until it must be balanced."),
    ] = "3 s",
    density: Annotated[
        str, typer.Option(metavar="steel", help="Or ceramic, tungsten carbide, '7.8 g/cm^3'.")
    ] = "steel",
    balls: Annotated[
        str, typer.Option(metavar="2..6", help="Numbers that are looked at.")
    ] = "2..6",
    share: Annotated[
        str, typer.Option(metavar="90%", help="Of drives that must be balanced by then.")
    ] = "90%",
    left: Annotated[
        str, typer.Option(metavar="10%", help="Of the largest unbalance, that may be left.")
    ] = "10%",
    drag_tolerance: Annotated[
        str, typer.Option(metavar="20%", help="By which the drag of built drives is off.")
    ] = "20%",
    friction_arm: Annotated[
        str, typer.Option(metavar="'0.1 um'", help="Of rolling friction, which runs then have.")
    ] = "0 m",
    runs: Annotated[int, typer.Option(metavar="N", help="Drives, to check each claim by.")] = 400,
    seed: Annotated[int, typer.Option(min=0, help="Of the random draws.")] = 0,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    json: JsonOption = None,
    scene: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the sized drive, to run: .yaml.")
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw drag windows, and shares predicted and seen."),
    ] = None,
) -> None:
    """Size a balancer: balls, drag and start-up from what the drive must do; each claim is run.

    Numbers may have their unit; without, they are SI. For each number of balls it looks for the
    lightest ones with a drag window: above the drag up to which balls circulate, and such that the
    wanted share of drives is balanced in time. The widest window is taken, and its start-up is run
    over drives that differ in unbalance, start angles and drag; with a hold of the speed only if
    too few balance without.

    What runs contradict is said so. Where nothing can be sized it says why, and what to change,
    with exit code 1. The JSON has `candidates`, `chosen`, `hold`, `claims` (claim, predicted, seen,
    verdict), `at_drags`, `runs` and the `scene`. What is done is kept.
    """
    from ab_sim.cli.size import size_command
    from ab_sim.design.sizing.specification import SpecificationTexts

    given = SpecificationTexts(
        mass, critical, speed, race_radius, race_width, unbalance, grade, damping_ratio,
        acceleration, settle, density, balls, friction_arm=friction_arm,
    )  # fmt: skip
    shares = {"share": share, "left": left, "drag-tolerance": drag_tolerance}
    size_command(given, shares, (runs, seed), (workers, scheduler), scene).run(json, plot)
