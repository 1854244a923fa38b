"""`ab-sim modes`."""

import math
from collections.abc import Iterator

from rich.table import Table

from ab_sim.analysis.modes import AVERAGE, ZERO, Mode, NaturalVibration, moving, vibration_of
from ab_sim.base.presentation import Progress
from ab_sim.cli.analysis_commands import ModesOptions
from ab_sim.cli.checks import check_speed
from ab_sim.cli.runner import Command, Outcome, picture
from ab_sim.scene import load_scene


def modes_command(options: ModesOptions) -> Command:
    """Return the command that computes the deck's modes, at a speed and over speeds."""
    check_speed(options.speed)
    scene = load_scene(options.scene, options.change)

    def work(_: Progress) -> Outcome:
        modes = vibration_of(scene, options.speed)
        draw = picture("ab_sim.show.figures.campbell:campbell_figure", modes)
        return Outcome(_shown(modes), modes.report, draw)

    return Command(work)


def modes_table(vibration: NaturalVibration) -> Table:
    """Return the table of modes."""
    table = Table(title=f"{vibration.scene}: modes at {vibration.speed:g} rad/s")
    for name in ("rad/s", "Hz", "damping ratio", "whirl", "largest motion"):
        table.add_column(name, justify="right" if name in ("rad/s", "Hz") else "left")
    largest = max(abs(value) for mode in vibration.modes for value in mode.eigenvalues)
    for mode in vibration.modes:
        table.add_row(
            f"{mode.frequency:.2f}",
            f"{mode.frequency / (2.0 * math.pi):.3f}",
            _damping(mode, ZERO * largest),
            _whirl(mode),
            ", ".join(moving(vibration.linearised, mode)),
        )
    return table


def _whirl(mode: Mode) -> str:
    return mode.sense or ("back and forth" if mode.damped_frequency > 0.0 else "no oscillation")


def _damping(mode: Mode, rounding: float) -> str:
    if mode.growth > rounding:
        return f"grows, {mode.growth:.3g} 1/s"
    return "nothing restores it" if mode.damping_ratio is None else f"{mode.damping_ratio:.4f}"


def _shown(vibration: NaturalVibration) -> Iterator[Table | str]:
    yield modes_table(vibration)
    about, over_speed = vibration.linearised, vibration.over_speed
    yield f"undamped frequencies; {AVERAGE}"
    if not about.stiffness.any():
        yield (
            "nothing holds the deck at its rest position: no suspension or mount of the scene has "
            "a stiffness there"
        )
    if any(about.rest):
        yield f"about the deck's rest position: {about.hangs}"
    met = [f"{w:.2f}" + (f" ({m.sense})" if m.sense else "") for w, m in over_speed.critical]
    yield (
        f"critical speeds up to {over_speed.speeds[-1]:g} rad/s, at which a frequency equals the "
        f"spindle's speed: {', '.join(met) or 'none'}"
    )
