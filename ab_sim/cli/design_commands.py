"""Commands for design decisions over many drives."""

from pathlib import Path
from typing import Annotated, NamedTuple

from typer import Option

from ab_sim.cli.declare import (
    Changes,
    Csv,
    Heading,
    Json,
    Parquet,
    Plot,
    SceneName,
    Scheduler,
    Seed,
    Units,
    Workers,
)

choose_a_design = Heading("Choose a design")


@choose_a_design.declare("ab_sim.cli.design:size_command")
class SizeOptions(NamedTuple):
    """Size a balancer: balls, drag and start-up for given limits.

    Numbers may have a unit; without one, they are in SI units.

    1. For each number of balls, the command looks for the lightest balls with a drag window: a
       range of drag in which balls do not circulate, and the required share of drives is balanced
       in time.
    2. It chooses the widest window, and simulates the start-up of drives that differ in unbalance,
       start angles and drag. It adds a hold of the speed only if too few drives balance without
       one.
    3. It reports runs that contradict a prediction.

    If no balancer fits, the command prints the reason and a remedy, with exit code 1. Finished runs
    are cached.

    Parameters
    ----------
    mass MASS
        Mass of everything that moves on the suspension, without balls, e.g. '100 g'.
    critical SPEED
        Critical speed without balls, e.g. '100 rad/s'.
    speed SPEED
        Running speed, above the critical speed, e.g. '200 rad/s'.
    race_radius LENGTH
        Inner radius of the wall that balls roll on, e.g. '12 mm'.
    race_width LENGTH
        Width of the race, which limits the balls' diameter, e.g. '4 mm'.
    unbalance UNBALANCE
        Largest unbalance, e.g. '0.3 g cm'; or LEAST..LARGEST: each value in this range is equally
        likely.
    grade GRADE
        Balance grade of the rotors by ISO 21940-11, e.g. G6.3, instead of --unbalance.
    damping_ratio RATIO
        Damping ratio of the suspension, c / (2 sqrt(k M)).
    acceleration ACCELERATION
        Angular acceleration of the start-up, e.g. '40 rad/s^2'. Default: the running speed is
        reached within 1 s.
    settle TIME
        Time from reaching the running speed within which a drive must be balanced.
    density DENSITY
        Material of the balls: steel, ceramic or tungsten carbide; or their density, e.g. '7.8
        g/cm^3'.
    balls FROM..TO
        Numbers of balls to try, from 2 to 12.
    share PERCENT
        Share of drives that must be balanced in time.
    residual PERCENT
        Residual unbalance up to which a drive counts as balanced, in percent of the largest
        unbalance.
    drag_tolerance PERCENT
        Tolerance of the drag of built drives.
    friction_arm LENGTH
        Lever arm of the balls' rolling friction in the runs, e.g. '0.1 um'.
    runs N
        Number of simulated drives that check each prediction.
    scene_file --scene FILE
        Write the sized drive as a scene: .yaml.
    plot
        Draw drag windows, and predicted and observed shares: .png, .svg or .pdf.
    """

    mass: str
    critical: str
    speed: str
    race_radius: str
    race_width: str
    unbalance: str | None = None
    grade: str | None = None
    damping_ratio: float = 0.05
    acceleration: str | None = None
    settle: str = "3 s"
    density: str = "steel"
    balls: str = "2..6"
    share: str = "90%"
    residual: str = "10%"
    drag_tolerance: str = "20%"
    friction_arm: str = "0 m"
    runs: int = 400
    seed: Seed = 0
    workers: Workers = None
    scheduler: Scheduler = None
    json: Json = None
    scene_file: Path | None = None
    plot: Plot = None


@choose_a_design.declare("ab_sim.cli.design:sweep_command")
class SweepOptions(NamedTuple):
    """Run a scene over ranges of its values, and judge each run.

    Finished runs are cached: after an interruption, the same command continues; after a complete
    sweep, it returns immediately. Results do not depend on the number of processes or machines.

    A row of the result has the run's number, the keys' values, the metrics, and `outcome`:

    * settled
    * still changing: the final whirl still rises or falls
    * circulates: balls go round the race
    * aborted: an adaptive start-up gave up, and stopped the spindle
    * failed: the column `failure` has the reason; other runs are not affected

    Whirls are in units of the eccentricity e of their run; all other values are in SI units.
    `ab_sim.open_sweep("FILE.parquet")` reads the result again; pandas, polars and DuckDB read the
    file directly.

    Parameters
    ----------
    over KEY=VALUES
        Key to vary, and its values: KEY=FROM..TO:COUNT, KEY=log:FROM..TO:COUNT (logarithmic steps)
        or KEY=V,V,...; with --design, KEY=FROM..TO. Any key of the scene, in SI units or with a
        unit. Repeatable: all combinations are run.
    design sobol:N|lhs:N
        N points that fill the ranges, instead of a grid: a scrambled Sobol sequence (N a power of
        2) or a Latin hypercube.
    metrics NAME,NAME,...
        Metrics to compute; `ab-sim metrics` lists them. Default: final_whirl_over_e, in_band_from,
        peak_whirl_over_e, residual_unbalance.
    plot
        Draw the metrics over one key, or maps over two keys. With more keys, draw the runs as
        points over each pair of keys. .png, .svg or .pdf.
    """

    scene: SceneName
    over: list[str]
    change: Changes = []
    design: str | None = None
    seed: Seed = 0
    metrics: str | None = None
    workers: Workers = None
    scheduler: Scheduler = None
    json: Json = None
    parquet: Parquet = None
    csv: Csv = None
    plot: Plot = None
    units: Units = ""


@choose_a_design.declare("ab_sim.cli.design:tune_command")
class TuneOptions(NamedTuple):
    """Optimise values of a scene within limits.

    Differential evolution searches the whole ranges; the method of Nelder and Mead then searches
    near the best candidate. Only settled runs count: not failed, no circulating balls, and a final
    whirl that neither rises nor falls. If no run settles within all bounds, the exit code is 1.

    The command prints the best values and their metric, and for comparison the metric

    * of the unchanged scene, and without its variable-speed period;
    * with each key 5 % smaller and larger.

    It names the ends of ranges and the bounds that limit the best values.

    With --spread, a candidate is judged by the worst metric among the best --share of its drives.
    All candidates have the same draws; about --runs / --draws candidates are tried.

    The same seed gives the same result. Finished runs are cached: after an interruption, the same
    command continues.

    Parameters
    ----------
    vary KEY=FROM..TO
        Key to vary, and its range; KEY=log:FROM..TO searches on a logarithmic scale. Keys
        like balls.count get whole numbers only. Repeatable.
    minimise METRIC
        Metric to minimise; `ab-sim metrics` lists metrics.
    maximise METRIC
        Metric to maximise, instead of --minimise.
    subject_to BOUND
        Bound that must hold, e.g. 'final_whirl_over_e<0.2', balanced, 'not balls_circulate'.
        Repeatable.
    spread KEY=SPREAD
        Tolerance of a key of built drives, as in `ab-sim robust`, e.g. balls.mass=5%. Repeatable.
    draws N
        With --spread, number of drives that are simulated for each candidate.
    share PERCENT
        With --spread, share of a candidate's drives that must settle within all bounds. The
        worst metric in this share, counted from the best drive, judges the candidate.
    runs N
        Approximate largest number of runs.
    best_scene --scene FILE
        Write the best scene: .yaml.
    plot
        Draw the metric of the candidates over each key: .png, .svg or .pdf.
    """

    scene: SceneName
    vary: list[str]
    change: Changes = []
    minimise: str | None = None
    maximise: str | None = None
    subject_to: list[str] = []
    spread: list[str] = []
    draws: Annotated[int, Option(min=2)] = 32
    share: str = "90%"
    runs: int = 1000
    seed: Seed = 0
    workers: Workers = None
    scheduler: Scheduler = None
    json: Json = None
    best_scene: Path | None = None
    parquet: Parquet = None
    plot: Plot = None
    units: Units = ""


@choose_a_design.declare("ab_sim.cli.design:robust_command")
class RobustOptions(NamedTuple):
    """Estimate the share of built drives that balance.

    Draws random drives, runs them, and reports the share that balances, quantiles of metrics, and
    which tolerance causes most of the variation (Sobol indices).

    All intervals are 95 % confidence intervals: Wilson's for the share, order statistics for
    quantiles, bootstrap for Sobol indices, Newcombe's for paired differences of designs. Errors of
    the model itself are not included. Whirls are in units of the eccentricity e of their run; all
    other values are in SI units.

    Finished runs are cached: with more --runs, a finer --until, or after an interruption, the
    command continues. Results do not depend on the number of processes.

    Parameters
    ----------
    spread KEY=SPREAD
        Tolerance of a key, e.g. balls.mass=5%. Forms: 5% or '0.1 mm' (standard deviation of a
        normal distribution about the scene's value), normal:MEAN,SD, lognormal:MEDIAN,40%,
        uniform:LOW,HIGH, uniform:5%, discrete:V,V,...; start.ball_angles=random. After a comma:
        low=NUMBER, high=NUMBER (limits), 'per ball' (a draw for each ball), group=NAME (one draw
        for all keys of the group). Repeatable, also for the same key.
    spread_from FILE
        Uncertainty of a fitted scene, from the JSON of `ab-sim identify`: its values with their
        correlations, in addition to --spread.
    runs N
        Number of drives; with --until, the smallest number.
    until PERCENT
        Run more drives until the half-width of the interval of the share is at most this, e.g.
        0.1%.
    balanced CONDITION
        Condition for a balanced drive, in addition to a settled run, e.g.
        'residual_unbalance<=0.1'. Repeatable: all must hold. Default: the metric balanced.
    metrics NAME,NAME,...
        Metrics to report quantiles of. Default: those of `ab-sim sweep`.
    against SCENE
        Scene of another design to compare with; it is run with the same draws.
    sobol N
        Number N of pairs of drives for the Sobol indices, a power of 2; 0: no Sobol indices. Each
        spread or group costs N further runs. Default: the largest N whose further runs are at most
        half of --runs, or 0 if this N is below 128.
    worst FOLDER
        Write the scenes of the ten worst runs to a folder.
    plot
        Draw distributions of the metrics, and the Sobol indices: .png, .svg or .pdf.
    """

    scene: SceneName
    spread: list[str] = []
    spread_from: Path | None = None
    change: Changes = []
    runs: Annotated[int, Option(min=1)] = 10_000
    until: str | None = None
    balanced: list[str] = []
    metrics: str | None = None
    against: str | None = None
    sobol: Annotated[int | None, Option(min=0)] = None
    seed: Seed = 0
    worst: Path | None = None
    workers: Workers = None
    scheduler: Scheduler = None
    json: Json = None
    parquet: Parquet = None
    csv: Csv = None
    plot: Plot = None
    units: Units = ""


@choose_a_design.declare("ab_sim.cli.sensitivity:sensitivity_command")
class SensitivityOptions(NamedTuple):
    """Compute how much each value of a scene changes the result.

    Changes each value by a small amount up and down, and compares the runs. Each derivative has an
    uncertainty that covers the error of this method. If balls collide or stick, the uncertainty may
    be large, or a metric not differentiable. Metrics that are not numbers, or are the time of a
    sample, have no derivative.

    Exit codes: 0 done, 2 bad input, 3 diverged.

    Parameters
    ----------
    of METRIC,...
        Metrics to differentiate; `ab-sim metrics` lists them.
    to KEY,...
        Keys to change, e.g. balls.mass,rotor.eccentricity,start.ball_angles.0. Default: all keys
        that act on the scene's motion.
    plot
        Draw elasticities (percent per percent) as bars: .png, .svg or .pdf.
    """

    scene: SceneName
    change: Changes = []
    of: str = "final_whirl_over_e"
    to: Annotated[str | None, Option(show_default=False)] = None
    json: Json = None
    plot: Plot = None
