"""Commands that run a scene, list the content of scenes, and write them in other forms."""

from pathlib import Path
from typing import Annotated, NamedTuple

from typer import Argument, Option

from ab_sim.cli.declare import (
    STEPPERS,
    Changes,
    Heading,
    Json,
    ListJson,
    Now,
    Plot,
    Quartiles,
    Repeats,
    SceneName,
    View,
)

run_and_watch = Heading("Run and watch")
write_a_scene = Heading("Write a scene")
accuracy_and_cost = Heading("Accuracy and what it costs")
other_tools = Heading("Other tools")


@run_and_watch.declare("ab_sim.cli.live:run_demo")
class DemoOptions(NamedTuple):
    """Run a start-up that balances, live over ROS 2, and judge it.

    A table and a picture compare it with the same start-up without its variable-speed period, and
    without balls. With --view web, the run starts when a browser shows the page, or with Enter;
    after the run the page is served until Ctrl-C.

    Parameters
    ----------
    out FOLDER
        Folder in which the recording startup.rrd and the picture startup.png are written.
    """

    out: Path = Path("out")
    view: View = "none"
    now: Now = False


@run_and_watch.declare("ab_sim.cli.run:run_command")
class RunOptions(NamedTuple):
    """Simulate a scene offline, at full speed, and judge the run.

    The table has the metrics of the run. For comparison, it also has those of a run without the
    variable-speed period, and of a run without balls. Final values are taken over the last tenth of
    the run. `ab-sim metrics` lists units, meanings and equations. Symbols, signs and angles:
    docs/conventions.md

    The JSON has the same metrics, and `samples` of the motion at the times of --times.

    Exit codes: 0 done, 2 bad input, 3 diverged.

    Parameters
    ----------
    times T,T,...
        Times of the samples [s], e.g. 2.5,3,6; the run lasts until the last of them. Default: 101
        times, evenly spaced over the scene's duration.
    step SECONDS
        Length of an integration step [s], instead of the scene's.
    units UNIT,UNIT,...
        Units of lengths, speeds, angles and torques in the table, e.g. 'um,rpm,deg'. With a unit of
        length, the table has W in this unit instead of W/e.
    plot
        Draw speed, W/e, driving force, ball angles and motor torque: .png, .svg or .pdf.
    rrd FILE
        Write a Rerun recording of every step: .rrd.
    every N
        With --rrd, record only every Nth step, and the steps at which the commanded speed starts or
        stops changing.
    """

    scene: SceneName
    change: Changes = []
    times: str | None = None
    stepper: Annotated[
        str | None,
        Option(
            metavar="NAME",
            help=f"Integration method, instead of the scene's: {', '.join(STEPPERS)}.",
        ),
    ] = None
    step: float | None = None
    units: str = ""
    json: Json = None
    plot: Plot = None
    rrd: Path | None = None
    every: Annotated[int, Option(min=1)] = 1


@run_and_watch.declare("ab_sim.cli.live:run_live")
class LiveOptions(NamedTuple):
    """Run a scene in real time over ROS 2: all nodes in one command.

    With --view web, the run starts when a browser shows the page, or with Enter; after the run the
    page is served until Ctrl-C. A viewer's window stays until you close it. `ab-sim view FILE`
    shows a recording again. Ctrl-C shuts the nodes down in order; a second Ctrl-C kills them.

    Parameters
    ----------
    record FILE
        Write a Rerun recording: .rrd. An existing file is kept, and a new one with a number is
        written next to it. Default: with --view, recordings/DATE_TIME.rrd.
    seconds --for SECONDS
        Simulated time of the run [s]. Default: the scene's duration.
    """

    scene: SceneName
    change: Changes = []
    view: View = "none"
    record: Path | None = None
    seconds: float | None = None
    now: Now = False


@run_and_watch.declare("ab_sim.cli.view:run_view")
class ViewOptions(NamedTuple):
    """Show recordings in Rerun's viewer, side by side.

    If a file is still being recorded, the viewer follows it. The viewer runs until its window is
    closed, or until Ctrl-C. It sends nothing to other machines.

    Parameters
    ----------
    files FILE...
        Recordings of runs: .rrd.
    web
        Show the recordings in a browser, at an address that the command prints.
    port PORT
        With --web, port of the web page; 0: any free port.
    """

    files: Annotated[list[Path], Argument()]
    web: Annotated[bool, Option("--web")] = False
    port: Annotated[int, Option(min=0, max=65535)] = 0


@write_a_scene.declare("ab_sim.cli.lists:print_scenes")
class ScenesOptions(NamedTuple):
    """List the scenes that come with ab_sim, or describe one.

    Parameters
    ----------
    name NAME
        Scene to describe: a name from the list, or a YAML file. Default: list all.
    """

    name: Annotated[str | None, Argument()] = None


@write_a_scene.declare("ab_sim.cli.check:print_check")
class CheckOptions(NamedTuple):
    """Check a scene without running it, and summarise it.

    If the scene requests an accuracy, the best stepper and its cost are measured on runs of the
    scene, as in `ab-sim run`.
    """

    scene: SceneName
    change: Changes = []


@write_a_scene.declare("ab_sim.cli.lists:print_keys")
class KeysOptions(NamedTuple):
    """List the keys of a scene: unit, range, default, meaning.

    `N` stands for the number of an entry in a list, counted from 0; `NAME` for a name that you
    choose. A required key is required only if its section is given. `-` means that there is no
    unit, range or default. `ab-sim effects` and `ab-sim sensors` describe effects and sensors;
    `ab-sim run --set KEY=VALUE` changes a key. A number may have any unit of the key's dimension:
    `12 mm`, `2500 rpm`.

    Parameters
    ----------
    section SECTION
        Beginning of the keys to list, e.g. rotor, effects.motor, solver.parameters.
    """

    section: Annotated[str, Argument(show_default=False)] = ""
    json: ListJson = False


@write_a_scene.declare("ab_sim.cli.lists:print_effects")
class EffectsOptions(NamedTuple):
    """List the effects that a scene can name, with their equations.

    An effect is a force or constraint that a scene can add to the drive's model.
    `ab-sim effects suspension --equation` prints the formulas in its code: the force
    f_1 = -c v_1 - k u_1, the energy and the loss; symbols as in docs/equations.md.

    Parameters
    ----------
    name NAME
        Effect to print. Default: all.
    equation
        Print all formulas, derived from the code: as text, then as LaTeX.
    """

    name: Annotated[str | None, Argument()] = None
    equation: Annotated[bool, Option("--equation")] = False


@write_a_scene.declare("ab_sim.cli.lists:print_sensors")
class SensorsOptions(NamedTuple):
    """List the sensors that a scene can have, with their equations."""


@write_a_scene.declare("ab_sim.cli.lists:print_metrics")
class MetricsOptions(NamedTuple):
    """List the metrics that a run is judged by, with their equations.

    `ab-sim run --json` and `metrics_of` in Python use these names.

    * Unit: e is a length in eccentricities, 1 is dimensionless, - is not a number.
    * Better: smaller, larger or neither; true counts as larger than false.
    * Equation: the last stretch is the last tenth of the run; t_l is its beginning.

    Symbols and signs: docs/conventions.md

    Parameters
    ----------
    name NAME
        Metric to print. Default: all.
    """

    name: Annotated[str | None, Argument(show_default=False)] = None
    json: ListJson = False


@write_a_scene.declare("ab_sim.cli.lists:print_schema")
class SchemaOptions(NamedTuple):
    """Print the JSON Schema of scene files, for editors.

    With yaml-language-server (VS Code's YAML extension, Neovim, Emacs, Helix): run
    `ab-sim schema --out scene.schema.json`, and begin a scene in the same folder with the line
    `# yaml-language-server: $schema=scene.schema.json`

    The editor then shows meanings and units, and marks unknown keys and numbers out of range.
    `ab-sim check` also checks whether the keys fit together.

    Parameters
    ----------
    out FILE
        Write the schema to a file: .json. Default: standard output.
    """

    out: Path | None = None


@accuracy_and_cost.declare("ab_sim.cli.costs:accuracy_command")
class AccuracyOptions(NamedTuple):
    """Measure error against CPU time for each stepper.

    The command takes minutes; shorten a long scene with --set duration=2.

    * Errors of ball angle, whirl and energy balance are differences from a reference, whose
      uncertainty is reported. For scenes without friction, contact and motor the reference is
      independent; for others it is ab_sim at short steps.
    * CPU time per simulated second is the fraction of one core that a run in real time needs.
    * `pip install 'ab_sim[peers]'` adds SUNDIALS and MuJoCo to the comparison.

    Parameters
    ----------
    plot
        Draw errors over CPU time: .png, .svg or .pdf.
    """

    scene: SceneName
    change: Changes = []
    repeats: Repeats = 9
    quartiles: Quartiles = False
    json: Json = None
    plot: Plot = None


@accuracy_and_cost.declare("ab_sim.cli.costs:cost_command")
class CostOptions(NamedTuple):
    """Measure the CPU time that each effect of a scene costs.

    Measures steps without effects, with each effect alone, and with all effects of the scene.

    Parameters
    ----------
    leave_one_out
        Also measure, for each effect, all effects of the scene except this one.
    plot
        Draw the times with their quartiles: .png, .svg or .pdf.
    """

    scene: SceneName
    change: Changes = []
    repeats: Repeats = 15
    leave_one_out: Annotated[bool, Option("--leave-one-out")] = False
    quartiles: Quartiles = False
    json: Json = None
    plot: Plot = None


@other_tools.declare("ab_sim.cli.c:c_command")
class COptions(NamedTuple):
    """Write a scene's drive as C99 source or as an FMU.

    The code has the scene's equations, steps of fixed length, live commands, the speed profile, and
    accelerometers without noise. The scene must be smooth, with an explicit stepper: effects with
    events (friction, contact, a motor) are refused.

    * C: any C99 compiler with IEEE doubles and -ffp-contract=off gives the same bits as
      `ab-sim run`. The source comes with a program that checks this.
    * FMU: with `cc` on PATH it has a binary for this machine, otherwise sources only.

    See docs/howto/c.md

    Parameters
    ----------
    out FOLDER
        Write C source, header, CMakeLists.txt and README to a folder.
    fmu FILE
        Write an FMU (FMI 3.0, co-simulation): .fmu.
    """

    scene: SceneName
    change: Changes = []
    out: Path | None = None
    fmu: Path | None = None
