"""Commands of `ab-sim` and their options; other modules of this package do the work."""

from pathlib import Path
from typing import Annotated

import typer

import ab_sim
from ab_sim.cli.analysis_commands import analysis_commands
from ab_sim.cli.bag_commands import bag_commands
from ab_sim.cli.design_commands import design_commands
from ab_sim.cli.identify_commands import identify_commands
from ab_sim.cli.key_commands import key_commands
from ab_sim.cli.node_commands import node_commands
from ab_sim.cli.options import (
    JsonOption,
    NowOption,
    RunJsonOption,
    RunPlotOption,
    RunRecordingOption,
    SceneArgument,
    SetOption,
    StepOption,
    StepperOption,
    ThinningOption,
    TimesOption,
    ViewOption,
)
from ab_sim.cli.recording_commands import recording_commands
from ab_sim.cli.usage import CommandGroup

app = typer.Typer(
    name="ab-sim",
    cls=CommandGroup,
    help="Simulate an optical disc drive with a ball-type automatic balancer.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
)


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
    times: TimesOption = None,
    stepper: StepperOption = None,
    step: StepOption = None,
    json: RunJsonOption = None,
    plot: RunPlotOption = None,
    rrd: RunRecordingOption = None,
    every: ThinningOption = 1,
) -> None:
    """Simulate a scene offline, at full speed, and judge the run.

    The JSON has `samples` (one per time, each with t, psi, omega, u, v, x, y, vx, vy, whirl, theta,
    ball_rate, stuck, and where the scene has them motor_torque, readings; of a deck in space also
    z, vz, tilt [alpha, beta, gamma] and angular_velocity on inertial axes), events,
    steps_with_unresolved_events, what was run, and what the run is judged by, each by its name:
    `ab-sim merits` lists these with units, meanings and equations. final_stretch says how long the
    last stretch is, over which final values are taken. The same run without_variable_speed_period
    and without_balls is judged alike. Where the scene asks for an accuracy, what was measured and
    what it costs. Symbols, signs and angles: docs/conventions.md

    Exit codes: 0 done, 2 bad input, 3 diverged.
    """
    from json import dumps as quoted

    from ab_sim.cli.offline import run_command

    changes = [*(change or [])]
    if stepper is not None:
        changes.append(f"solver.stepper={quoted(stepper)}")
    if step is not None:
        changes.append(f"solver.step={step!r}")
    run_command(scene, changes, times, json is not None, rrd, every).run(json, plot)


@app.command()
def scenes(
    name: Annotated[
        str | None, typer.Argument(help="Say all of this one, or of a scene's YAML file.")
    ] = None,
) -> None:
    """List the scenes that come with ab_sim, or describe one."""
    from ab_sim.cli.scenes import print_scene, print_scenes

    if name is None:
        print_scenes()
    else:
        print_scene(name)


@app.command()
def effects(
    name: Annotated[str | None, typer.Argument(help="Print this effect only.")] = None,
    equation: Annotated[
        bool,
        typer.Option(
            "--equation", help="Print all formulas, made from the code: as text, then as LaTeX."
        ),
    ] = False,
) -> None:
    """List the effects that a scene can name, with their equations.

    `ab-sim effects suspension --equation` prints what its code computes: f_1 = -c v_1 - k u_1,
    the energy and the loss; symbols as in docs/equations.md.
    """
    if equation:
        from ab_sim.cli.formulas import print_formulas

        print_formulas(name)
        return
    from ab_sim.cli.tables import print_effects

    print_effects(name)


@app.command()
def sensors() -> None:
    """List the sensors that a scene can have, with their equations."""
    from ab_sim.cli.tables import print_sensors

    print_sensors()


@app.command()
def merits(
    name: Annotated[
        str | None, typer.Argument(help="Print this merit only.", show_default=False)
    ] = None,
    json: Annotated[
        bool, typer.Option("--json", help="Print the same as JSON, a list of merits.")
    ] = False,
) -> None:
    """List the merits that a run is judged by, with their equations.

    By these names `ab-sim run --json` and `merits_of` in Python give them. Unit e: a length in
    eccentricities, 1: it has none, -: it is no number. False is smaller than true. The last stretch
    is the last tenth of the run, t_l its beginning. The JSON has `name`, `unit`, `better` (smaller,
    larger, neither), `kind` (number, true or false, structure), `meaning` and `equation` of each.
    Symbols and signs: docs/conventions.md
    """
    from ab_sim.cli.merit_list import print_merits

    print_merits(name, json)


@app.command()
def check(scene: SceneArgument, change: SetOption = None) -> None:
    """Check a scene without running it, and say what it simulates.

    If the scene requests an accuracy, the best stepper and its cost are measured on runs of the
    scene, as in `ab-sim run`.
    """
    from ab_sim.scene_files import find_scene

    find_scene(scene)  # refuses a missing scene before slow imports
    from ab_sim.cli.tables import print_check

    print_check(scene, change or [])


@app.command()
def urdf(scene: SceneArgument, change: SetOption = None) -> None:
    """Print a scene as a URDF, for robot_state_publisher.

    `drive_sim` publishes the same on the topic robot_description, for RViz. Joints have the names
    that they have in joint_states; `drive_sim` publishes the deck's pose on tf.
    """
    from ab_sim.drive.urdf import urdf_of
    from ab_sim.scene import load_scene

    print(urdf_of(load_scene(scene, change or [])), end="")


@app.command()
def c(
    scene: SceneArgument,
    change: SetOption = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Write source, header, CMakeLists.txt, README there."),
    ] = None,
    fmu: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write it as an FMU (FMI 3.0, co-simulation): .fmu."),
    ] = None,
) -> None:
    """Write a scene's drive as C99 source or as an FMU.

    The equations of its kind of scene, steps of a fixed length, live commands, its speed profile,
    its accelerometers (without noise). The same bits as `ab-sim run` with any C99 compiler that has
    IEEE doubles and does not fuse what is not said to be (-ffp-contract=off): a check that comes
    along tries it. Only smooth scenes: effects with events (friction, contact, a motor) are
    refused, and so is a stepper that is no explicit method. docs/howto/c.md

    With `cc` on PATH the FMU has a binary for this machine; else its sources only.
    """
    from ab_sim.scene_files import find_scene

    find_scene(scene)  # refuses a missing scene before slow imports
    from ab_sim.cli.c import c_command

    c_command(scene, change or [], out, fmu).run()


@app.command()
def cost(
    scene: SceneArgument,
    change: SetOption = None,
    repeats: Annotated[int, typer.Option(help="Interleaved repeats.")] = 15,
    leave_one_out: Annotated[
        bool, typer.Option("--leave-one-out", help="Also the scene's set less each effect.")
    ] = False,
    json: JsonOption = None,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the times with their spread.")
    ] = None,
) -> None:
    """Measure the time that each effect of a scene costs.

    With no effects, with each alone, with the scene's set. The first time takes some seconds per
    effect, and more for friction and contact, to compile the kernels.
    """
    from ab_sim.cli.cost import cost_command

    cost_command(scene, change or [], repeats, leave_one_out).run(json, plot)


@app.command()
def accuracy(
    scene: SceneArgument,
    change: SetOption = None,
    repeats: Annotated[int, typer.Option(help="Interleaved repeats.")] = 9,
    json: JsonOption = None,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw errors over CPU time, log-log.")
    ] = None,
) -> None:
    """Measure error against CPU time for each stepper.

    Errors in ball angle, whirl and energy balance against a reference whose own uncertainty is
    stated: an independent one for scenes without friction, contact and motor, for others ab_sim's
    own at short steps. CPU time per simulated second, which is the share of one core that real
    time takes. SUNDIALS and MuJoCo come along with pip install 'ab_sim[peers]'. It takes minutes;
    shorten a long scene with --set duration=2.
    """
    from ab_sim.cli.accuracy import accuracy_command

    accuracy_command(scene, change or [], repeats).run(json, plot)


@app.command()
def demo(
    out: Annotated[Path, typer.Option(help="Folder for startup.rrd and startup.png.")] = Path(
        "out"
    ),
    view: ViewOption = "none",
    now: NowOption = False,
) -> None:
    """Run a start-up that balances, live over ROS 2, and judge it.

    The table and the picture show it beside the same start-up without its variable-speed period,
    and without balls. With --view web, the run starts when a browser shows the page, or with Enter;
    after the run the page is served until Ctrl-C.
    """
    from ab_sim.cli.demo import run_demo

    run_demo(out, view, now)


@app.command()
def live(
    scene: SceneArgument,
    change: SetOption = None,
    view: ViewOption = "none",
    record: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Keep a Rerun recording: .rrd. A file that is there is not overwritten, "
            "another is made beside it. Default: with --view, recordings/DATE_TIME.rrd.",
        ),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(
            "--for", metavar="SECONDS", help="How long, in simulated time. Default: the scene's."
        ),
    ] = None,
    now: NowOption = False,
) -> None:
    """Run a scene in real time over ROS 2: all nodes in one command.

    With --view web, the run starts when a browser shows the page, or with Enter; after the run the
    page is served until Ctrl-C. A viewer's window stays until you close it. `ab-sim view FILE`
    shows a recording again. Ctrl-C ends the run in order, a second one at once.
    """
    from ab_sim.cli.live import run_live

    run_live(scene, change or [], view, record, seconds, now)


@app.command()
def view(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Recordings: .rrd.")],
    web: Annotated[
        bool, typer.Option("--web", help="In a browser, at the address that is printed.")
    ] = False,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Of the page with --web; 0: any that is free.")
    ] = 0,
) -> None:
    """Show recordings in Rerun's viewer, side by side.

    A file that is still being recorded is followed.

    Until the window is closed, or Ctrl-C. Nothing is sent to anybody.
    """
    from ab_sim.cli.view import run_view

    run_view(files, web, port)


app.add_typer(key_commands)
app.add_typer(analysis_commands)
app.add_typer(design_commands)
app.add_typer(recording_commands)
app.add_typer(identify_commands)
app.add_typer(bag_commands)
app.add_typer(node_commands, name="node")
