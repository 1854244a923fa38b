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

    Symbols, signs and angles: docs/conventions.md

    Parameters
    ----------
    speed SPEED
        Spindle speed for the table of modes [rad/s].
    plot
        Draw frequencies and damping over speed (Campbell diagram): .png, .svg or .pdf.
    """

    scene: SceneName
    change: Changes = []
    speed: float = 0.0
    json: Json = None
    plot: Plot = None


@stability_and_vibration.declare("ab_sim.cli.stability:equilibria_command")
class EquilibriaOptions(NamedTuple):
    """Find resting states at a constant speed, and their stability.

    In a resting state, the balls do not move relative to the rotor. The command prints:

    * All resting states at one speed, with the largest real part of their eigenvalues, lambda_max
      [1/s]. Above 0, a state is unstable.
    * The speeds up to spindle.max_speed at which states begin, end and become unstable, and the
      ranges without a stable state.
    * Bunches of balls that can circulate instead of resting.

    Labels: a state p+q has p balls on the side of the displacement and q balls on the opposite
    side; of two such states, /1 has the larger whirl and /2 the smaller. If balls differ, the label
    has a sign for each: + on the side of the displacement, - opposite. The balanced state has no
    whirl.

    The verdicts neglect friction and contact of balls. Symbols, signs and angles:
    docs/conventions.md

    Parameters
    ----------
    plot
        Draw the branches over speed: .png, .svg or .pdf.
    """

    scene: SceneName
    change: Changes = []
    speed: Speed = None
    json: Json = None
    plot: Plot = None


@stability_and_vibration.declare("ab_sim.cli.stability:stability_command")
class StabilityOptions(NamedTuple):
    """Map stability over two values, or outcomes over start angles.

    * A map (--map) shows for which values the balanced state is stable, and whether all balls can
      circulate instead. Only points near borders are computed. They are kept, so that an
      interrupted map continues.
    * A basin (--basin) shows how runs from different start angles end. Starts with equal balls at
      one angle are omitted, because these balls never separate. A run counts as balanced below
      the limits in the scene's section `balanced`, e.g. with
      `--set balanced.residual_unbalance=0.05`.
    * Without --map and --basin, the command does the same as `ab-sim equilibria`.

    Symbols, signs and angles: docs/conventions.md

    Parameters
    ----------
    map KEY=RANGE,KEY=RANGE
        Keys of the map's two axes, horizontal and vertical. A range is FROM:TO or FROM:TO:COUNT,
        with 200 values by default; e.g. speed=50:300,balls.mass=0.001:0.004.
    coarse N
        Spacing of the points of the map that are computed first, a power of two. Regions smaller
        than N by N points may be missed; 1 computes every point. Default: 8.
    against BALLS
        Compare the map with that of another number of balls of the same total mass.
    each KEY=V,V,...
        Further key, with one map for each of its values, e.g. balls.mass=0.001,0.002,0.004. One
        picture shows the borders of all maps.
    basin N
        Map how runs of the scene end, from N by N start angles of its first two balls.
    plot
        Draw the map or the basin: .png, .svg or .pdf.
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
    Scenes with friction, contact or a motor are refused.

    Newton's method finds a periodic motion. Its Floquet multipliers decide on stability: they are
    the eigenvalues of the exact derivative of the state after one turn by the state before it. If
    the largest modulus is below 1, nearby motions return to the solution. Multipliers that are 1
    because balanced states form a continuum are ignored.

    Symbols, signs and angles: docs/conventions.md

    Parameters
    ----------
    begin --from START
        Start of the search: start (the scene's start), balanced (the balanced position) or settled
        (the state after some hundreds of turns). Default: all three.
    over KEY=FROM:TO:COUNT
        Follow a solution over the speed, e.g. speed=100:500:41, or over a key of the scene, e.g.
        race.radius=0.02:0.04:21, and locate the borders of stability.
    plot
        Draw the multipliers in the complex plane; with --over the largest modulus over the
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

    All values are computed with the scene's balls, and with one ball of their total mass:

    * Amplitude: the largest whirl after the change of speed has begun.
    * Settling time: from this maximum until the whirl stays within 1e-6 mm of its value at the next
      resting state.
    * lambda_Rmax: the largest real part of the resting state's eigenvalues.
    * Composite index: settling time + amplitude x mean settling time / mean amplitude, with means
      over the drags.

    Results are cached in ~/.cache/ab_sim.

    Symbols, signs and angles: docs/conventions.md

    Parameters
    ----------
    drags FROM:TO:COUNT
        Range of drag coefficients of the race to compare [N s/m], and their number; they are evenly
        spaced.
    plot
        Draw settling time and amplitude over drag: .png, .svg or .pdf.
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
    NAME.md, a page of Markdown, and its pictures.

    Parameters
    ----------
    name NAME
        Name of the paper to reproduce. Default: list all papers.
    out FOLDER
        Folder in which the page and its pictures are written.
    """

    name: Annotated[str | None, Argument(show_default=False)] = None
    out: Path = Path("out/papers")
    json: Json = None
