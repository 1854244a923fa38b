"""Commands on vibration, resting states and stability."""

from pathlib import Path
from typing import Annotated, NamedTuple

from typer import Argument

from ab_sim.cli.declare import Heading
from ab_sim.cli.options import Changes, Json, Plot, SceneName, Speed

stability_and_vibration = Heading("Stability and vibration")


@stability_and_vibration.declare("ab_sim.cli.modes:modes_command")
class ModesOptions(NamedTuple):
    """Compute the deck's natural frequencies, damping and modes.

    The modes are vibrations about the deck's rest position, at one spindle speed, and over speeds
    from 0 to spindle.max_speed, where gyroscopic moments change them. Rotor and balls are averaged
    over one turn; the balls are spread evenly, and turn with the rotor.

    The JSON has `modes`, by frequency, each with frequency [rad/s], the undamped one |lambda|;
    damping_ratio, null if the frequency is 0; damped_frequency, 0 if it does not oscillate; shape,
    real and imaginary part for each of the `coordinates` in their `units`, the largest being 1; its
    two eigenvalues lambda [1/s], conjugate, or real if overdamped; whirl, from 1 for a circle in
    the spindle's direction to -1 for one against it; and sense: forward, backward, or null for back
    and forth. Then `speed`, `rest` (the deck's rest position), and `over_speed`: the same for each
    branch over `speeds`, and critical_speeds, at which a branch's frequency is the spindle's speed.

    Symbols, signs and angles: docs/conventions.md

    Args:
        speed SPEED: Spindle speed of the table [rad/s].
        plot: Draw frequencies and damping over speed (Campbell): .png, .svg or .pdf.
    """

    scene: SceneName
    change: Changes = []
    speed: float = 0.0
    json: Json = None
    plot: Plot = None


@stability_and_vibration.declare("ab_sim.cli.equilibria:equilibria_command")
class EquilibriaOptions(NamedTuple):
    """Find resting states at a constant speed, and their stability.

    Prints all resting states at one speed: p+q has p balls on the side of the displacement and q
    opposite, /1 the larger whirl and /2 the smaller; a sign per ball if balls differ; balanced has
    no whirl. For speeds up to spindle.max_speed it prints the speeds at which states begin, end
    and become unstable, and the ranges without a stable state. The verdicts neglect friction and
    contact of balls.

    The JSON has `branches`, each with label, W and u (on the rotating axes) [m], phase and theta
    [rad], assignments (number of ways to assign the places to the balls, null in a continuum),
    eigenvalues [re, im] [1/s], structural_zeros (number of zero eigenvalues because states form a
    continuum), lambda_max (the largest real part except these), stable (null: undecided) and
    verdict; comes_back, whether an undecided state returns after a disturbance of each coordinate;
    and held_by_friction, for each ball the range [low, high] of theta in which friction holds all
    balls, the others in place (null without friction). `balanced_positions` are the positions
    over which worst and best are taken for three and more balls: all, or sampled ones if balls
    differ. `over_speed` has branches, folds, crossings and ranges [rad/s]. `circulation` has
    `states`, stable bunches of circulating balls, with their number, speed [rad/s], the state in
    closed form and its ranges over speed [rad/s] and drag [N s/m], and the exact state of all
    balls; `elsewhere`, speeds at which all balls could circulate; and `not_looked_for`, the reason
    if there was no search. `other_motions` names motions that are not searched for. Symbols, signs
    and angles: docs/conventions.md

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

    A map is refined only near borders, and computed points are kept: an interrupted map continues.
    Its JSON has `across` and `up`, each with key and values; `labels`, rows of whole numbers;
    `kinds`, each with label, name and share of the map; the number of `points`, and of `computed`
    ones; `balanced_positions`, by which of them three and more balls are judged (all, or sampled if
    balls differ); `circulation`: `labels` of the points at which all balls can circulate in one
    stable bunch (1; 0: not; 2: not known; -1: not looked for), in closed form, and its shares of
    the map; with --against, shares that are balanced for both or one of the two. With --each it has
    key, values, and `maps`, one for each value.

    A basin's JSON has `angles` [rad] of either ball; `labels`, rows by the second ball, -1 for
    starts that are left out; `kinds` with their shares of the other starts; residual_unbalance and
    final_whirl [m] of each run, null if unknown. Equal balls that start at one angle never part,
    and are left out. The scene defines balanced, e.g. `--set balanced.residual_unbalance=0.05`.

    Without --map and --basin, the command is `ab-sim equilibria`.

    Symbols, signs and angles: docs/conventions.md

    Args:
        map KEY=RANGE,KEY=RANGE: Map over two keys, across and up. A range is FROM:TO or
            FROM:TO:COUNT, with 200 values by default; e.g. speed=50:300,balls.mass=0.001:0.004.
        coarse N: Spacing of the first points of a map, a power of two; islands of fewer than N by
            N points may be missed; 1 computes every point. Default: 8.
        against BALLS: Compare the map with that of another number of balls of the same total mass.
        each KEY=V,V,...: One map for each of these values of another key, e.g.
            balls.mass=0.001,0.002,0.004; drawn as borders in one picture.
        basin N: Run the scene from N by N start angles of its first two balls.
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


@stability_and_vibration.declare("ab_sim.cli.floquet:floquet_command")
class FloquetOptions(NamedTuple):
    """Find motions that repeat each turn, and their stability.

    The speed is constant. Use it for scenes whose equations contain the spindle's angle (a deck in
    space, unequal suspension, gravity across the shaft); it takes others, too. Newton's method
    finds a motion; its multipliers over one turn, the eigenvalues of the exact derivative of the
    steps, decide on stability. Scenes with friction, contact or a motor are refused.

    The JSON has `found`, `multipliers` ([re, im], by modulus), `largest` (their largest modulus
    except structural_ones), `stable` (null: undecided), `speed`, period, found_from, balanced,
    whirl_min and whirl_max [m], ball_angles, ball_turns, ball_swing [rad], start (the state at the
    start of a turn, by state_names), residual (in units of e, rad and speed), iterations, steps,
    halved_step_difference; `others`, the same for further solutions; and with --over `followed`:
    `points` over the parameter, and `borders`, where the largest modulus is 1. If there is no
    solution, found is false.

    Symbols, signs and angles: docs/conventions.md

    Args:
        begin --from START: Start of the search: start (the scene's start), balanced (the balanced
            position) or settled (the state after some hundreds of turns). Default: each of them.
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


@stability_and_vibration.declare("ab_sim.cli.recovery:recovery_command")
class RecoveryOptions(NamedTuple):
    """Show how a drive recovers from a change of speed.

    Settling time: from the largest whirl after the change of speed has begun, until the whirl stays
    within 1e-6 mm of its value at the next resting state. Maximum amplitude: that largest whirl.
    lambda_Rmax: the largest real part of the resting state's eigenvalues. Composite index: settling
    time + amplitude x mean settling time / mean amplitude, with means over the drags. All are
    computed with the scene's balls, and with one ball of their total mass.

    The JSON has, at the scene's drag, settling_time [s], null if it does not settle;
    maximum_amplitude [m], peak_time and settled_at [s]; steady_whirl [m], label, lambda_max [1/s]
    and verdict of the resting state; rested_before, whether the drive rested when the change began;
    and duration of the run. `over_drag` has the same at each drag, with its composite_index [s];
    then best_drag; and `one_ball`, all of these with one ball. Results are kept in ~/.cache/ab_sim.

    Symbols, signs and angles: docs/conventions.md

    Args:
        drags FROM:TO:COUNT: Drags of the race [N s/m], evenly spaced.
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

    Papers come with the sources of ab_sim, in docs/gallery. The command writes NAME.md, a page of
    Markdown, and its pictures. The JSON has `sections`, each with heading, text, tables (title,
    columns, rows) and pictures (file, caption).

    Args:
        name NAME: Name of the paper. Default: list all papers.
        out FOLDER: Folder for page and pictures.
    """

    name: Annotated[str | None, Argument(show_default=False)] = None
    out: Path = Path("out/papers")
    json: Json = None
