"""Commands on vibration, resting states and stability."""

from pathlib import Path
from typing import Annotated, NamedTuple

from typer import Argument

from ab_sim.cli.declare import Changes, Heading, Json, Plot, SceneName, Speed

stability_and_vibration = Heading("Stability and vibration")


@stability_and_vibration.declare("ab_sim.cli.vibration:modes_command")
class ModesOptions(NamedTuple):
    """Compute the deck's natural frequencies, damping and modes.

    The modes are vibrations about the deck's rest position, at one spindle speed, and over speeds
    from 0 to spindle.max_speed, where gyroscopic moments change them. Rotor and balls are averaged
    over one turn; the balls are spread evenly, and turn with the rotor.

    The JSON has `modes`, by rising frequency. A mode has frequency (undamped, |lambda|) [rad/s];
    damping_ratio (null if the frequency is 0); damped_frequency [rad/s] (0 if it does not
    oscillate); and two eigenvalues lambda [1/s], conjugate, or real if overdamped. Its shape has
    the real and imaginary part of each of the `coordinates` in their `units`; the largest is 1. Its
    whirl is 1 for a circle in the spindle's direction, and -1 for one against it; sense is forward,
    backward, or null for back and forth. The JSON also has `speed`, `rest` (the deck's rest
    position), and `over_speed`: modes of each branch over `speeds`, and critical_speeds, at which
    a branch's frequency equals the spindle's speed.

    Symbols, signs and angles: docs/conventions.md

    Args:
        speed SPEED: Spindle speed for the table of modes [rad/s].
        plot: Draw frequencies and damping over speed (Campbell diagram): .png, .svg or .pdf.
    """

    scene: SceneName
    change: Changes = []
    speed: float = 0.0
    json: Json = None
    plot: Plot = None


@stability_and_vibration.declare("ab_sim.cli.stability:equilibria_command")
class EquilibriaOptions(NamedTuple):
    """Find resting states at a constant speed, and their stability.

    In a resting state, the balls do not move relative to the rotor. The command prints all resting
    states at one speed, by label. A state p+q has p balls on the side of the displacement and q
    balls on the opposite side; of two such states, /1 has the larger whirl and /2 the smaller. If
    balls differ, the label has a sign for each ball. The balanced state has no whirl. For speeds up
    to spindle.max_speed, the command prints the speeds at which states begin, end and become
    unstable, and the ranges without a stable state. The verdicts neglect friction and contact of
    balls.

    The JSON has `branches`, each with label, W and u (on the rotating axes) [m], phase and theta
    [rad], assignments (number of ways to assign the places to the balls, null in a continuum),
    eigenvalues [re, im] [1/s], structural_zeros (number of zero eigenvalues because states form a
    continuum), lambda_max (the largest real part of the others), stable (null: undecided) and
    verdict. A branch also has comes_back: whether an undecided state returns after a disturbance of
    each coordinate. Its held_by_friction (null without friction) has a range [low, high] of theta
    for each ball: friction holds all balls there, while the others stay in place.

    For three and more balls, `balanced_positions` states among which balanced positions the least
    and the most stable were chosen: all, or sampled if balls differ. `over_speed` has branches,
    folds, crossings and ranges [rad/s]. `circulation` has `states`: stable bunches of circulating
    balls, with their number, speed [rad/s], the state in closed form, its ranges over speed [rad/s]
    and drag [N s/m], and the exact state of all balls. Its `elsewhere` has speeds at which all
    balls could circulate; `not_looked_for` is the reason if there was no search. `other_motions`
    names motions that are not searched for. Symbols, signs and angles: docs/conventions.md

    Args:
        plot: Draw the branches over speed: .png, .svg or .pdf.
    """

    scene: SceneName
    change: Changes = []
    speed: Speed = None
    json: Json = None
    plot: Plot = None


@stability_and_vibration.declare("ab_sim.cli.stability:stability_command")
class StabilityOptions(NamedTuple):
    """Map stability over two values, or outcomes over start angles.

    A map shows for which values the balanced state is stable. A basin shows how runs end.

    A map is refined only near borders, and computed points are kept: an interrupted map continues.
    Its JSON has `across` and `up`, each with key and values; `labels`, rows of whole numbers;
    `kinds`, each with label, name and share of the map; the number of `points`, and of `computed`
    ones. For three and more balls, `balanced_positions` states which positions were examined: all,
    or sampled if balls differ. `circulation` states in closed form whether all balls can circulate
    in one stable bunch: `labels` of the points (1: yes, 0: no, 2: not known, -1: not searched for),
    and shares of the map. With --against, the JSON also has the shares of the map that are balanced
    with both numbers of balls, and with only one of them. With --each, the JSON has key, values,
    and `maps`, one for each value.

    A basin's JSON has `angles` [rad] of either ball; `labels`, rows by the second ball, -1 for
    omitted starts; `kinds` with their shares of the other starts; residual_unbalance and
    final_whirl [m] of each run, null if unknown. Starts with equal balls at one angle are omitted,
    because these balls never separate. The scene sets the limit of a balanced run, e.g. by
    `--set balanced.residual_unbalance=0.05`.

    Without --map and --basin, the command does the same as `ab-sim equilibria`.

    Symbols, signs and angles: docs/conventions.md

    Args:
        map KEY=RANGE,KEY=RANGE: Keys of the map's two axes, horizontal and vertical. A range is
            FROM:TO or FROM:TO:COUNT, with 200 values by default; e.g.
            speed=50:300,balls.mass=0.001:0.004.
        coarse N: Spacing of the points of the map that are computed first, a power of two. Regions
            smaller than N by N points may be missed; 1 computes every point. Default: 8.
        against BALLS: Compare the map with that of another number of balls of the same total mass.
        each KEY=V,V,...: Further key, with one map for each of its values, e.g.
            balls.mass=0.001,0.002,0.004. One picture shows the borders of all maps.
        basin N: Map how runs of the scene end, from N by N start angles of its first two balls.
        plot: Draw the map or the basin: .png, .svg or .pdf.
    """

    scene: SceneName
    change: Changes = []
    speed: Speed = None
    map: str | None = None
    coarse: int | None = None
    against: int | None = None
    each: str | None = None
    basin: int | None = None
    json: Json = None
    plot: Plot = None


@stability_and_vibration.declare("ab_sim.cli.vibration:floquet_command")
class FloquetOptions(NamedTuple):
    """Find motions that repeat each turn, and their stability.

    The speed is constant. The command is meant for scenes whose equations contain the spindle's
    angle (a deck in space, unequal suspension, gravity across the shaft), and accepts others.
    Newton's method finds a periodic motion. Its Floquet multipliers decide on stability: the
    eigenvalues of the exact derivative of the steps over one turn. Scenes with friction, contact or
    a motor are refused.

    The JSON has `found` (false if there is no solution), `multipliers` ([re, im], by modulus),
    structural_ones (number of multipliers that are 1 because balanced states form a continuum),
    `largest` (largest modulus of the others), `stable` (null: undecided), `speed`, period,
    found_from (where the search started), balanced, whirl_min and whirl_max [m]; and of the balls
    ball_angles at the start of the turn, ball_turns relative to the rotor, and ball_swing (range of
    the angle) [rad]. For the numerics it has start (the state at the start of the turn, by
    state_names), residual (largest mismatch after one turn, scaled by e, rad and speed),
    iterations, steps, and halved_step_difference (largest change of a multiplier with half the
    step). `others` has these entries for further
    solutions. With --over, `followed` has `points` over the parameter, and `borders`, where the
    largest modulus is 1.

    Symbols, signs and angles: docs/conventions.md

    Args:
        begin --from START: Start of the search: start (the scene's start), balanced (the balanced
            position) or settled (the state after some hundreds of turns). Default: all three.
        over KEY=FROM:TO:COUNT: Follow a solution over the speed, e.g. speed=100:500:41, or over a
            key of the scene, e.g. race.radius=0.02:0.04:21, and locate the borders of stability.
        plot: Draw the multipliers in the complex plane; with --over the largest modulus over the
            parameter: .png, .svg or .pdf.
    """

    scene: SceneName
    change: Changes = []
    speed: Speed = None
    begin: str = ""
    over: str | None = None
    json: Json = None
    plot: Plot = None


@stability_and_vibration.declare("ab_sim.cli.vibration:recovery_command")
class RecoveryOptions(NamedTuple):
    """Show how a drive recovers from a change of speed.

    The maximum amplitude is the largest whirl after the change of speed has begun. The settling
    time is the time from this maximum until the whirl stays within 1e-6 mm of its value at the next
    resting state. lambda_Rmax is the largest real part of the resting state's eigenvalues. The
    composite index is settling time + amplitude x mean settling time / mean amplitude, with means
    over the drags. All are computed with the scene's balls, and with one ball of their total mass.

    The JSON has, at the scene's drag, settling_time [s] (null if the whirl does not settle),
    maximum_amplitude [m], peak_time and settled_at [s]; steady_whirl [m], label, lambda_max [1/s]
    and verdict of the resting state; rested_before, whether the drive was in a resting state when
    the change began; and duration of the run. `over_drag` has these values at each drag, with their
    composite_index [s]. best_drag has the smallest index. `one_ball` has all of these with one
    ball. Results are cached in ~/.cache/ab_sim.

    Symbols, signs and angles: docs/conventions.md

    Args:
        drags FROM:TO:COUNT: Range of drag coefficients of the race to compare [N s/m], and their
            number; they are evenly spaced.
        plot: Draw settling time and amplitude over drag: .png, .svg or .pdf.
    """

    scene: SceneName
    change: Changes = []
    drags: str = "0.1:0.5:5"
    json: Json = None
    plot: Plot = None


@stability_and_vibration.declare("ab_sim.cli.paper:paper_command")
class PaperOptions(NamedTuple):
    """Reproduce a published paper: its figures and numbers.

    The scripts of the papers are in docs/gallery, in the sources of ab_sim. The command writes
    NAME.md, a page of Markdown, and its pictures. The JSON has `sections`, each with heading, text,
    tables (title, columns, rows) and pictures (file, caption).

    Args:
        name NAME: Name of the paper to reproduce. Default: list all papers.
        out FOLDER: Folder in which the page and its pictures are written.
    """

    name: Annotated[str | None, Argument(show_default=False)] = None
    out: Path = Path("out/papers")
    json: Json = None
