"""Commands that ask where a drive vibrates and rests, and how firmly, instead of running it."""

from pathlib import Path
from typing import Annotated

import typer

from ab_sim.cli.options import (
    AgainstOption,
    BasinOption,
    CoarseOption,
    EachOption,
    HeldSpeedOption,
    JsonOption,
    MapOption,
    MapPlotOption,
    SceneArgument,
    SetOption,
)

analysis_commands = typer.Typer()


@analysis_commands.command()
def modes(
    scene: SceneArgument,
    change: SetOption = None,
    speed: Annotated[float, typer.Option(help="Of the spindle [rad/s], for the table.")] = 0.0,
    json: JsonOption = None,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw frequencies and damping over speed (Campbell)."),
    ] = None,
) -> None:
    """Compute the deck's natural frequencies, damping and modes.

    About where it hangs at rest, at one speed of the spindle, and over speeds from 0 to
    spindle.max_speed, where gyroscopic moments change them. Rotor and balls are averaged over one
    turn; the balls spread evenly, and turn with the rotor.

    The JSON has `modes`, by frequency, each with frequency [rad/s], the undamped one |lambda|;
    damping_ratio, null where the frequency is 0; damped_frequency, 0 where it does not swing;
    shape, real and imaginary part for each of the `coordinates` in their `units`, the largest being
    1; its two eigenvalues lambda [1/s], conjugates, or two real ones where it is damped more than
    critically; whirl, from 1 for a circle in the spindle's sense to -1 for one against it,
    and sense, forward, backward or null for to and fro. Then `speed`, `rest` (where the deck
    hangs), and `over_speed`: the same of each branch over `speeds`, and critical_speeds, at which
    a branch's frequency is the spindle's speed.

    Symbols, signs and angles: docs/conventions.md
    """
    from ab_sim.cli.modes import modes_command

    modes_command(scene, change or [], speed).run(json, plot)


@analysis_commands.command()
def equilibria(
    scene: SceneArgument,
    change: SetOption = None,
    speed: Annotated[
        float | None,
        typer.Option(
            help="Of the spindle [rad/s], for the table. Default: the one at which the scene's "
            "profile ends."
        ),
    ] = None,
    json: JsonOption = None,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw the branches over speed: .png, .svg or .pdf."),
    ] = None,
) -> None:
    """Find where balls can rest at a constant speed, and if stable.

    All resting states at one speed: p+q has p balls on the side of the displacement and q
    opposite, /1 the larger whirl and /2 the smaller; a sign per ball where balls differ; balanced
    has no whirl. And over speed, up to spindle.max_speed: where states begin, end, and turn
    unstable, and ranges of speed without any stable state. Friction and contact of balls are left
    out of the verdicts.

    The JSON has `branches`, each with label, W and u (on the rotating axes) [m], phase and theta
    [rad], assignments (ways to give the places to the balls, null in a continuum), eigenvalues
    [re, im] [1/s], structural_zeros (how many of them are 0 because states form a continuum),
    lambda_max (the largest real part but for these), stable (null: undecided) and verdict;
    comes_back, of an undecided one, whether motions disturbed along each coordinate do; and
    held_by_friction, for each ball [low, high] of theta in which friction holds all of them, the
    others in place (null without friction); `balanced_positions`, of which positions worst and
    best are, of three and more balls: all, or, of balls that differ, sampled ones; and `over_speed`
    with branches, folds, crossings and ranges [rad/s]; `circulation`: `states`, bunches of balls
    that circulate stably at the speed, with their number, speed [rad/s], the closed form's state
    and its ranges over speed [rad/s] and drag [N s/m], and the exact one of all balls; `elsewhere`,
    speeds at which all could, and `not_looked_for`, why nothing was; `other_motions`, what is not
    looked for. Symbols, signs and angles: docs/conventions.md
    """
    from ab_sim.cli.equilibria import equilibria_command

    equilibria_command(scene, change or [], speed).run(json, plot)


@analysis_commands.command()
def stability(
    scene: SceneArgument,
    change: SetOption = None,
    speed: HeldSpeedOption = None,
    axes: MapOption = None,
    coarse: CoarseOption = None,
    against: AgainstOption = None,
    each: EachOption = None,
    basin: BasinOption = None,
    json: JsonOption = None,
    plot: MapPlotOption = None,
) -> None:
    """Map stability over two values, or the starts that end balanced.

    A map is computed where it changes only, and so is what was computed before: an interrupted one
    goes on. Its JSON has `across` and `up`, each with key and values; `labels`, rows of whole
    numbers; `kinds`, each with label, name and share of the map; how many `points` there are and
    how many were `computed`; `balanced_positions`, by which of them three and more balls are judged
    (all, or sampled where balls differ); `circulation`: `labels` of the points at which all balls
    can circulate in one stable bunch (1; 0: not; 2: not known; -1: not looked for), by a closed
    form, and its shares of the map; with `--against`, shares that are balanced for both or one
    of the two. With `--each` it has key, values, and `maps`, one such for each value.

    A basin's JSON has `angles` [rad] of either ball; `labels`, rows by the second ball; `kinds`
    with their shares of the starts that are not left out, which are -1 in labels;
    residual_unbalance and final_whirl [m] of each run, null where there is none. Equal balls that
    start at one angle never part, and are left out. Balanced is what the scene calls so, e.g.
    `--set balanced.residual_unbalance=0.05`.

    Without either it does what `ab-sim equilibria` does: states, and where over the speed they lose
    their stability.

    Symbols, signs and angles: docs/conventions.md
    """
    from ab_sim.cli.equilibria import equilibria_command
    from ab_sim.cli.stability import (
        basin_command,
        check_combination,
        family_command,
        map_command,
    )

    options = {"coarse": coarse, "against": against, "each": each, "speed": speed}
    given = {name for name, value in options.items() if value is not None}
    check_combination(given, axes is not None, basin is not None)
    spacing = 8 if coarse is None else coarse
    if axes is not None and each is not None:
        family_command(scene, change or [], speed, axes, spacing, each).run(json, plot)
    elif axes is not None:
        map_command(scene, change or [], speed, axes, spacing, against).run(json, plot)
    elif basin is not None:
        basin_command(scene, change or [], basin).run(json, plot)
    else:
        equilibria_command(scene, change or [], speed).run(json, plot)


@analysis_commands.command()
def floquet(
    scene: SceneArgument,
    change: SetOption = None,
    speed: Annotated[
        float | None,
        typer.Option(help="Of the spindle [rad/s]; default: what the scene keeps in the end."),
    ] = None,
    begin: Annotated[
        str,
        typer.Option(
            "--from",
            metavar="START",
            help="Search from the scene's start, from the balanced position, or from what has "
            "settled after some hundreds of turns: start, balanced, settled; default: from each.",
        ),
    ] = "",
    over: Annotated[
        str | None,
        typer.Option(
            metavar="KEY=FROM:TO:COUNT",
            help="Follow a solution over the speed, e.g. speed=100:500:41, or over a value of the "
            "scene, e.g. race.radius=0.02:0.04:21, and locate the borders of stability.",
        ),
    ] = None,
    json: JsonOption = None,
    plot: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Draw the multipliers in the complex plane; or the largest modulus over the "
            "parameter: .png, .svg or .pdf.",
        ),
    ] = None,
) -> None:
    """Find motions that repeat each turn, and if they are stable.

    At a speed that is held; for scenes whose spindle angle stays in the equations (a deck in space,
    unequal suspension, gravity across the shaft), and others too. Found by Newton's method, judged
    by their multipliers over one turn, the eigenvalues of the exact derivative of the steps taken.
    Scenes with friction, contact or a motor are refused.

    The JSON has `found`, `multipliers` ([re, im], by modulus), `largest` (their largest
    modulus, but for structural_ones), `stable` (null: undecided), `speed`, period, found_from,
    balanced, whirl_min and whirl_max [m], ball_angles, ball_turns, ball_swing [rad], start (the
    state at the start of a turn, by state_names), residual (in units of e, rad and speed),
    iterations, steps, halved_step_difference; `others`, the same of further solutions; and with
    --over `followed`: `points` over the parameter, and `borders`, where the largest modulus is 1.
    Where nothing was found, found is false.

    Symbols, signs and angles: docs/conventions.md
    """
    from ab_sim.cli.floquet import floquet_command

    floquet_command(scene, change or [], speed, begin, over).run(json, plot)


@analysis_commands.command()
def recovery(
    scene: SceneArgument,
    change: SetOption = None,
    drags: Annotated[
        str,
        typer.Option(metavar="A:B:N", help="Drags of the race: N of them from A to B [N s/m]."),
    ] = "0.1:0.5:5",
    json: JsonOption = None,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw settling time and amplitude over drag."),
    ] = None,
) -> None:
    """Show how a drive recovers from a change of speed.

    Settling time: from the instant of the largest whirl after the change of speed has begun to the
    one from which on the whirl stays within 1e-6 mm of that of the resting state that it goes to.
    Maximum amplitude: that largest whirl. lambda_Rmax: the largest real part of the resting state's
    eigenvalues. Composite index: settling time + amplitude x mean settling time / mean amplitude,
    the means over the drags asked for. With the scene's balls, and with one ball of all their mass.

    The JSON has settling_time [s], null if it does not settle; maximum_amplitude [m], peak_time and
    settled_at [s]; steady_whirl [m], label, lambda_max [1/s] and verdict of the resting state;
    rested_before, whether it rested when the change began; and duration of the run, all at the
    scene's own drag; `over_drag` the same at each drag, with its composite_index [s]; best_drag;
    and `one_ball` all that with one ball. What was computed once is kept in ~/.cache/ab_sim.

    Symbols, signs and angles: docs/conventions.md
    """
    from ab_sim.cli.recovery import recovery_command

    recovery_command(scene, change or [], drags).run(json, plot)


@analysis_commands.command()
def sensitivity(
    scene: SceneArgument,
    change: SetOption = None,
    of: Annotated[
        str,
        typer.Option(metavar="MERIT,...", help="What the run is judged by: see `ab-sim merits`."),
    ] = "final_whirl_over_e",
    to: Annotated[
        str | None,
        typer.Option(
            metavar="KEY,...",
            help="Numbers of the scene, e.g. balls.mass,rotor.eccentricity,start.ball_angles.0. "
            "Default: all that act on its motion.",
            show_default=False,
        ),
    ] = None,
    json: JsonOption = None,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw percents per percent as bars with uncertainties."),
    ] = None,
) -> None:
    """Compute how much each value of a scene changes the result.

    Each value is moved up and down by a little, and the runs are compared; the uncertainty of a
    derivative covers the error of that. Where balls collide or stick it may be large, or a merit
    not differentiable. Merits that are no numbers, or the time of a sample, have no derivative.

    The JSON has `merits`, by name each with value, unit, and `by` key: value and unit of the key,
    derivative (unit per unit; null where the merit is not differentiable), uncertainty (null where
    it is unknown) and elasticity (percent per percent; null without derivative or where the merit
    is 0).

    Exit codes: 0 done, 2 bad input, 3 diverged.
    """
    from ab_sim.cli.sensitivity import sensitivity_command

    sensitivity_command(scene, change or [], of, to).run(json, plot)


@analysis_commands.command()
def paper(
    name: Annotated[
        str | None, typer.Argument(help="Which one. Default: list them.", show_default=False)
    ] = None,
    out: Annotated[
        Path, typer.Option(metavar="FOLDER", help="Folder for its page and pictures.")
    ] = Path("out/papers"),
    json: JsonOption = None,
) -> None:
    """Reproduce a published paper: its figures and numbers.

    Papers come with the sources of ab_sim, in docs/gallery. Without a name, those there are.

    Writes NAME.md, a page of Markdown, and its pictures. The JSON has `sections`, each with
    heading, text, tables (title, columns, rows) and pictures (file, caption).
    """
    from ab_sim.cli.paper import paper_command, papers_command

    if name is None:
        papers_command()
    else:
        paper_command(name, out).run(json)
