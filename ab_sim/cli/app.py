"""Commands of `ab-sim` and their options; the work is done in the modules beside this one."""

from pathlib import Path
from typing import Annotated

import typer

import ab_sim
from ab_sim.papers import PAPERS

app = typer.Typer(
    name="ab-sim",
    help="Simulate an optical disc drive with a ball-type automatic balancer.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
)

_FILES = Path(__file__).parents[1].joinpath("integrate", "steppers").glob("[a-z]*.py")
STEPPERS = ("auto", *sorted(file.stem.replace("_", "-") for file in _FILES))
"""By their files: the registry takes a second to import, and help should not. A test compares."""

SceneArgument = Annotated[
    str, typer.Argument(help="Name of a scene (see `ab-sim scenes`) or path of a YAML file.")
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Change a value of the scene, e.g. balls.mass=0.002 or "
        "effects.viscous_drag.coefficient=2; an empty value removes the key. accuracy.angle=1e-9 "
        "[rad] or accuracy.whirl=1e-6 [e] asks for an error instead of the scene's solver: the "
        "cheapest stepper and step measured to deliver it are taken. Repeatable.",
    ),
]


def _version(show: bool) -> None:
    if show:
        print(f"ab_sim {ab_sim.__version__}")
        raise typer.Exit()


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


@app.command()
def run(
    scene: SceneArgument,
    change: SetOption = None,
    times: Annotated[
        str | None,
        typer.Option(
            metavar="T,T,...",
            help="When to take samples [s], e.g. 2.5,3,6; the run goes on to the last of them. "
            "Default: 101 times, evenly spaced over the scene's duration.",
        ),
    ] = None,
    stepper: Annotated[
        str | None, typer.Option(help=f"Stepper instead of the scene's: {', '.join(STEPPERS)}.")
    ] = None,
    step: Annotated[float | None, typer.Option(help="Step instead of the scene's [s].")] = None,
    json: Annotated[
        str | None,
        typer.Option(
            metavar="FILE|-",
            help="Write the result as JSON, SI units, to a .json file or to standard output.",
        ),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Draw speed, W/e, driving force, ball angles, motor torque: .png, .svg or .pdf.",
        ),
    ] = None,
    rrd: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write a Rerun recording of every step: .rrd."),
    ] = None,
) -> None:
    """Run a scene without ROS, as fast as it goes.

    The JSON has `samples` (one per time, each with t, psi, omega, u, v, x, y, vx, vy,
    whirl, theta, ball_rate, stuck, and where the scene has them motor_torque, readings; of a deck
    in space also z, vz, tilt [alpha, beta, gamma] and angular_velocity on inertial axes),
    events, crowded_steps, what was run, and what the run is judged by: peak_whirl_over_e,
    peak_time; final_whirl_over_e, the root mean square over the last tenth of the run
    (final_stretch), and whether it is still_changing; final_whirl_relative_to_no_balls;
    residual_unbalance, and of a deck in space residual_couple; peak_tilt and final_tilt of its
    shaft; in_band_from, the time from which the whirl stays within band_over_e of its
    final value; first_passage_of_opposite, the time at which all balls first have theta <= -180
    deg (less variable_speed_period, the time at which that starts, it is the thesis' "settling
    period"). The same run without_variable_speed_period and without_balls is judged alike. Where
    the scene asks for an accuracy, what was measured and what it costs.

    Exit codes: 0 done, 2 bad input, 3 diverged.
    """
    from json import dumps as quoted

    from ab_sim.cli.offline import run_command

    changes = [*(change or [])]
    if stepper is not None:
        changes.append(f"solver.stepper={quoted(stepper)}")
    if step is not None:
        changes.append(f"solver.step={step!r}")
    run_command(scene, changes, times, json, plot, rrd)


@app.command()
def scenes() -> None:
    """List the scenes that come with ab_sim."""
    from ab_sim.cli.tables import print_scenes

    print_scenes()


@app.command()
def effects(
    name: Annotated[str | None, typer.Argument(help="Print this effect only.")] = None,
) -> None:
    """List the effects that a scene can name: meaning, equation, source, parameters."""
    from ab_sim.cli.tables import print_effects

    print_effects(name)


@app.command()
def sensors() -> None:
    """List the sensors that a scene can have: meaning, equation, source, parameters."""
    from ab_sim.cli.tables import print_sensors

    print_sensors()


@app.command()
def check(scene: SceneArgument, change: SetOption = None) -> None:
    """Check a scene and say what it would simulate, without running it.

    But for one that asks for an accuracy: what delivers it, and at what price, is measured on runs
    of the scene, which takes a moment, and the first time some seconds more to compile it.
    """
    from ab_sim.cli.tables import print_check

    print_check(scene, change or [])


@app.command()
def cost(
    scene: SceneArgument,
    change: SetOption = None,
    repeats: Annotated[int, typer.Option(help="Interleaved repeats.")] = 15,
    leave_one_out: Annotated[
        bool, typer.Option("--leave-one-out", help="Also the scene's set less each effect.")
    ] = False,
    json: Annotated[
        str | None,
        typer.Option(metavar="FILE|-", help="Write the result as JSON, or to standard output."),
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the times with their spread.")
    ] = None,
) -> None:
    """Measure what each effect of a scene costs: time per step, and to get its kernel.

    With no effects, with each alone, with the scene's set. The first time takes some seconds per
    effect, and more for friction and contact, to compile the kernels.
    """
    from ab_sim.cli.cost import cost_command

    cost_command(scene, change or [], repeats, leave_one_out, json, plot)


@app.command()
def accuracy(
    scene: SceneArgument,
    change: SetOption = None,
    repeats: Annotated[int, typer.Option(help="Interleaved repeats.")] = 9,
    json: Annotated[
        str | None,
        typer.Option(metavar="FILE|-", help="Write the result as JSON, or to standard output."),
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw errors over CPU time, log-log.")
    ] = None,
) -> None:
    """Measure what an accuracy costs: each stepper over a range of steps, beside other solvers.

    Errors in ball angle, whirl and energy balance against a reference whose own uncertainty is
    stated: an independent one for scenes without friction, contact and motor, for others ab_sim's
    own at short steps. CPU time per simulated second, which is the share of one core that real
    time takes. SUNDIALS and MuJoCo come along with pip install 'ab_sim[peers]'. It takes minutes;
    shorten a long scene with --set duration=2.
    """
    from ab_sim.cli.accuracy import accuracy_command

    accuracy_command(scene, change or [], repeats, json, plot)


@app.command()
def modes(
    scene: SceneArgument,
    change: SetOption = None,
    speed: Annotated[float, typer.Option(help="Of the spindle [rad/s], for the table.")] = 0.0,
    json: Annotated[
        str | None,
        typer.Option(metavar="FILE|-", help="Write the result as JSON, or to standard output."),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw frequencies and damping over speed (Campbell)."),
    ] = None,
) -> None:
    """Natural frequencies, damping ratios and mode shapes of the deck in its suspension.

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
    """
    from ab_sim.cli.modes import modes_command

    modes_command(scene, change or [], speed, json, plot)


@app.command()
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
    json: Annotated[
        str | None,
        typer.Option(metavar="FILE|-", help="Write the result as JSON, or to standard output."),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw the branches over speed: .png, .svg or .pdf."),
    ] = None,
) -> None:
    """Where the balls can rest on the rotor at a speed that is held, and how firmly.

    All resting states at one speed: p+q has p balls on the side of the displacement and q
    opposite, /1 the larger whirl and /2 the smaller; a sign per ball where balls differ; balanced
    has no whirl. And over speed, up to spindle.max_speed: where states begin, end, and turn
    unstable, and ranges of speed without any stable state. Friction and contact of balls are left
    out of the verdicts.

    The JSON has `branches`, each with label, W and u (on the rotating axes) [m], phase and theta
    [rad], assignments (ways to give the places to the balls, null in a continuum), eigenvalues
    [re, im] [1/s], structural_zeros (how many of them are 0 because states form a continuum),
    lambda_max (the largest real part but for these), stable (null: undecided) and verdict; and
    `over_speed` with branches, folds, crossings and ranges [rad/s].
    """
    from ab_sim.cli.equilibria import equilibria_command

    equilibria_command(scene, change or [], speed, json, plot)


@app.command()
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
    json: Annotated[
        str | None,
        typer.Option(metavar="FILE|-", help="Write the result as JSON, or to standard output."),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Draw the multipliers in the complex plane; or the largest modulus over the "
            "parameter: .png, .svg or .pdf.",
        ),
    ] = None,
) -> None:
    """Motions that repeat with every turn of the spindle, and whether they are stable (Floquet).

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
    """
    from ab_sim.cli.floquet import floquet_command

    floquet_command(scene, change or [], speed, begin, over, json, plot)


@app.command()
def recovery(
    scene: SceneArgument,
    change: SetOption = None,
    drags: Annotated[
        str,
        typer.Option(metavar="A:B:N", help="Drags of the race: N of them from A to B [N s/m]."),
    ] = "0.1:0.5:5",
    json: Annotated[
        str | None,
        typer.Option(metavar="FILE|-", help="Write the result as JSON, or to standard output."),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw settling time and amplitude over drag."),
    ] = None,
) -> None:
    """How a scene recovers from its change of speed, and with which drag of the race best.

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
    """
    from ab_sim.cli.recovery import recovery_command

    recovery_command(scene, change or [], drags, json, plot)


@app.command()
def paper(
    name: Annotated[str, typer.Argument(help=f"Which one: {', '.join(PAPERS)}.")],
    out: Annotated[
        Path, typer.Option(metavar="FOLDER", help="Folder for its page and pictures.")
    ] = Path("out/papers"),
    json: Annotated[
        str | None,
        typer.Option(metavar="FILE|-", help="Write the result as JSON, or to standard output."),
    ] = None,
) -> None:
    """Compute a published paper again: its figures, and its values beside ours.

    Writes NAME.md, a page of Markdown, and its pictures. The JSON has `sections`, each with
    heading, text, tables (title, columns, rows) and pictures (file, caption).
    """
    from ab_sim.cli.paper import paper_command

    paper_command(name, out, json)


@app.command()
def stability(
    scene: SceneArgument,
    change: SetOption = None,
    speed: Annotated[
        float | None,
        typer.Option(
            help="Of the spindle [rad/s], held. Default: at which the scene's profile ends."
        ),
    ] = None,
    axes: Annotated[
        str | None,
        typer.Option(
            "--map",
            metavar="KEY=FROM:TO[:COUNT],KEY=FROM:TO[:COUNT]",
            help="Map two values of the scene, across and up, 200 of each unless told, e.g. "
            "speed=50:300,effects.suspension.damping=0.1:4.",
        ),
    ] = None,
    coarse: Annotated[
        int,
        typer.Option(
            metavar="N",
            help="Spacing of the points that a map begins with, a power of two: islands of fewer "
            "than N by N points may be missed; 1 computes every point.",
        ),
    ] = 8,
    against: Annotated[
        int | None,
        typer.Option(metavar="BALLS", help="Beside the map with so many balls, together as heavy."),
    ] = None,
    each: Annotated[
        str | None,
        typer.Option(
            metavar="KEY=V,V,...",
            help="A map for each of these values of another key, e.g. "
            "effects.viscous_drag.coefficient=0.1,0.2,0.4; drawn as borders in one picture.",
        ),
    ] = None,
    basin: Annotated[
        int | None,
        typer.Option(
            metavar="N", help="Run the scene from N by N start angles of its first two balls."
        ),
    ] = None,
    limit: Annotated[
        float, typer.Option(help="Of a basin: share of the unbalance that may be left.")
    ] = 0.05,
    json: Annotated[
        str | None,
        typer.Option(metavar="FILE|-", help="Write the result as JSON, or to standard output."),
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the map: .png, .svg or .pdf.")
    ] = None,
) -> None:
    """Which resting states are stable over two values of the scene; which starts end balanced.

    A map is computed where it changes only, and so is what was computed before: an interrupted one
    goes on. Its JSON has `across` and `up`, each with key and values; `labels`, rows of whole
    numbers; `kinds`, each with label, name and share of the map; how many `points` there are and
    how many were `computed`; with `--against`, shares that are balanced for both or one of the two.
    With `--each` it has key, values, and `maps`, one such for each value.

    A basin's JSON has `angles` [rad] of either ball; `labels`, rows by the second ball; `kinds`
    with their shares of the starts that are not left out; residual_unbalance and final_whirl [m]
    of each run, null where there is none. Equal balls that start at one angle never part, and are
    left out.

    Without either it does what `ab-sim equilibria` does: states, and where over the speed they lose
    their stability.
    """
    from ab_sim.cli.equilibria import equilibria_command
    from ab_sim.cli.stability import basin_command, family_command, map_command
    from ab_sim.errors import InputError

    if axes is not None and basin is not None:
        raise InputError("--map and --basin: one at a time")
    if (against is not None or each is not None) and axes is None:
        raise InputError("--against, --each: are of maps; say what to map with --map")
    if against is not None and each is not None:
        raise InputError("--against and --each: one at a time")
    if axes is not None and each is not None:
        family_command(scene, change or [], speed, axes, coarse, each, json, plot)
    elif axes is not None:
        map_command(scene, change or [], speed, axes, coarse, against, json, plot)
    elif basin is not None:
        basin_command(scene, change or [], basin, limit, json, plot)
    else:
        equilibria_command(scene, change or [], speed, json, plot)


@app.command()
def demo(
    out: Annotated[Path, typer.Option(help="Folder for startup.rrd and startup.png.")] = Path(
        "out"
    ),
) -> None:
    """Run a start-up that gets balanced live: three ROS 2 nodes, recorded by Rerun, then judged.

    The table and the picture show it beside the same start-up without its variable-speed period,
    and without balls.
    """
    from ab_sim.cli.demo import run_demo

    run_demo(out)
