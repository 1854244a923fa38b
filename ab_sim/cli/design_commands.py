"""Commands for design decisions over many drives."""

import typer

from ab_sim.cli.design_options import (
    RobustAgainstOption,
    RobustBalancedOption,
    RobustMeritsOption,
    RobustParquetOption,
    RobustPlotOption,
    RobustRunsOption,
    RobustSeedOption,
    RobustSobolOption,
    RobustSpreadFromOption,
    RobustSpreadOption,
    RobustUntilOption,
    RobustWorstOption,
    SizeAccelerationOption,
    SizeBallsOption,
    SizeCriticalOption,
    SizeDampingRatioOption,
    SizeDensityOption,
    SizeDragToleranceOption,
    SizeFrictionArmOption,
    SizeGradeOption,
    SizeLeftOption,
    SizeMassOption,
    SizePlotOption,
    SizeRaceRadiusOption,
    SizeRaceWidthOption,
    SizeRunsOption,
    SizeSceneOption,
    SizeSettleOption,
    SizeShareOption,
    SizeSpeedOption,
    SizeUnbalanceOption,
    SweepCsvOption,
    SweepDesignOption,
    SweepMeritsOption,
    SweepOverOption,
    SweepParquetOption,
    SweepPlotOption,
    SweepSeedOption,
    TuneBestSceneOption,
    TuneDrawsOption,
    TuneMaximiseOption,
    TuneMinimiseOption,
    TuneParquetOption,
    TunePlotOption,
    TuneRunsOption,
    TuneSeedOption,
    TuneShareOption,
    TuneSpreadOption,
    TuneSubjectToOption,
    TuneVaryOption,
    UnitsOption,
)
from ab_sim.cli.options import JsonOption, SceneArgument, SchedulerOption, SetOption, WorkersOption

design_commands = typer.Typer()


@design_commands.command()
def sweep(
    scene: SceneArgument,
    over: SweepOverOption,
    change: SetOption = None,
    design: SweepDesignOption = None,
    seed: SweepSeedOption = 0,
    merits: SweepMeritsOption = None,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    json: JsonOption = None,
    parquet: SweepParquetOption = None,
    csv: SweepCsvOption = None,
    plot: SweepPlotOption = None,
    units: UnitsOption = "",
) -> None:
    """Run a scene over ranges of its values, and judge each run.

    Finished runs are kept: after an interruption the same command continues; repeated, it answers
    at once. Results do not depend on the number of processes or machines.

    A row has the run's number, the keys' values, the merits, `outcome` (settled; still changing,
    where the final whirl still rises or falls; circulates, where balls go round the race; aborted,
    where a start-up ran down to standstill; failed) and, of a run that was aborted or failed,
    `failure`: why. Other runs are not affected, and its merits are null. Whirls are in e [m] of the
    run, all else in SI units. The JSON has the rows by column in `runs`, `units`, `points`, which
    the values follow from, `outcomes`, and the `scene`.

    `ab_sim.open_sweep("FILE.parquet")` gives the result back; pandas, polars and DuckDB read the
    file as it is.
    """
    from ab_sim.cli.sweep import SweepOptions, sweep_command

    shared, files = (workers, scheduler), (parquet, csv)
    given = SweepOptions(over, design, seed, merits, units)
    sweep_command(scene, change or [], given, shared, files).run(json, plot)


@design_commands.command()
def tune(
    scene: SceneArgument,
    vary: TuneVaryOption,
    change: SetOption = None,
    minimise: TuneMinimiseOption = None,
    maximise: TuneMaximiseOption = None,
    subject_to: TuneSubjectToOption = None,
    spread: TuneSpreadOption = None,
    draws: TuneDrawsOption = 32,
    share: TuneShareOption = "90%",
    runs: TuneRunsOption = 1000,
    seed: TuneSeedOption = 0,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    json: JsonOption = None,
    best_scene: TuneBestSceneOption = None,
    parquet: TuneParquetOption = None,
    plot: TunePlotOption = None,
    units: UnitsOption = "",
) -> None:
    """Find the values with which a scene is best, within limits.

    First by differential evolution over the whole ranges, then near the best that it has found
    (Nelder and Mead). Only runs that settled count: that did not fail, whose balls do not circulate
    and whose whirl does not still rise or fall. Where no run settled within all bounds it says so,
    with exit code 1, and names no best.

    It shows the best values; the merit there, for the scene as it is, without its variable-speed
    period, and with each key 5 % less and more; and which ends of ranges and bounds the best is at.
    With --spread all of that is what a share of the drives reaches, each candidate having the same
    draws; the candidates are then --runs over --draws. The JSON has `found`, `values`, `best`,
    `active`, `beside`, `before`, the best `scene`, and all `runs` by column.

    The same seed gives the same answer. Finished runs are kept: after an interruption the same
    command continues.
    """
    from ab_sim.cli.tune import Wanted, tune_command

    wanted = Wanted(
        vary, minimise, maximise, subject_to or [], spread or [], draws, share, runs, seed,
        units,
    )  # fmt: skip
    shared, files = (workers, scheduler), (best_scene, parquet)
    tune_command(scene, change or [], wanted, shared, files).run(json, plot)


@design_commands.command()
def robust(
    scene: SceneArgument,
    spread: RobustSpreadOption = None,
    spread_from: RobustSpreadFromOption = None,
    change: SetOption = None,
    runs: RobustRunsOption = 10_000,
    until: RobustUntilOption = None,
    balanced: RobustBalancedOption = None,
    merits: RobustMeritsOption = None,
    against: RobustAgainstOption = None,
    sobol: RobustSobolOption = None,
    seed: RobustSeedOption = 0,
    worst: RobustWorstOption = None,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    json: JsonOption = None,
    parquet: RobustParquetOption = None,
    csv: SweepCsvOption = None,
    plot: RobustPlotOption = None,
    units: UnitsOption = "",
) -> None:
    """Estimate how many built drives balance, given tolerances.

    Runs are independent random draws. The share has Wilson's interval, quantiles have that of order
    statistics, first-order and total Sobol indices that of a bootstrap, differences of designs are
    paired: Newcombe's interval. All are of 95 %. What the model itself gets wrong is in none.

    A draw of a run does not depend on how many there are: with more --runs, or a finer --until, the
    command continues from the finished runs, which are kept even after an interruption. Results do
    not depend on the number of processes.

    The JSON has `share`, `quantiles` by merit, `sobol`, `worst`, `against`, the rows by column in
    `runs`, and `balanced` for each. Whirls are in e [m] of the run, all else in SI units.
    """
    from ab_sim.cli.robust import RobustOptions, robust_command

    shared = workers, scheduler
    given = RobustOptions(
        runs, seed, balanced or [], merits, sobol, until, against, shared, parquet, csv, worst,
        units, spread_from,
    )  # fmt: skip
    robust_command(scene, change or [], spread or [], given).run(json, plot)


@design_commands.command()
def size(
    mass: SizeMassOption,
    critical: SizeCriticalOption,
    speed: SizeSpeedOption,
    race_radius: SizeRaceRadiusOption,
    race_width: SizeRaceWidthOption,
    unbalance: SizeUnbalanceOption = None,
    grade: SizeGradeOption = None,
    damping_ratio: SizeDampingRatioOption = 0.05,
    acceleration: SizeAccelerationOption = None,
    settle: SizeSettleOption = "3 s",
    density: SizeDensityOption = "steel",
    balls: SizeBallsOption = "2..6",
    share: SizeShareOption = "90%",
    left: SizeLeftOption = "10%",
    drag_tolerance: SizeDragToleranceOption = "20%",
    friction_arm: SizeFrictionArmOption = "0 m",
    runs: SizeRunsOption = 400,
    seed: RobustSeedOption = 0,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    json: JsonOption = None,
    scene: SizeSceneOption = None,
    plot: SizePlotOption = None,
) -> None:
    """Size a balancer: balls, drag and start-up for given limits.

    Numbers may have their unit; without, they are SI. For each number of balls it looks for the
    lightest ones with a drag window: above the drag up to which balls circulate, and such that the
    wanted share of drives is balanced in time. The widest window is taken, and its start-up is run
    over drives that differ in unbalance, start angles and drag; with a hold of the speed only if
    too few balance without.

    Contradictions by runs are reported. If nothing can be sized, the command gives reason and
    remedy, with exit code 1. The JSON has `candidates`, `chosen`, `hold`, `claims` (claim,
    predicted, seen, verdict), `at_drags`, `runs` and the `scene`. Finished runs are kept.
    """
    from ab_sim.cli.size import size_command
    from ab_sim.design.sizing.specification import SpecificationTexts

    given = SpecificationTexts(
        mass, critical, speed, race_radius, race_width, unbalance, grade, damping_ratio,
        acceleration, settle, density, balls, friction_arm=friction_arm,
    )  # fmt: skip
    shares = {"share": share, "left": left, "drag-tolerance": drag_tolerance}
    size_command(given, shares, (runs, seed), (workers, scheduler), scene).run(json, plot)
