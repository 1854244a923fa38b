"""`ab-sim scenes`, `ab-sim effects`, `ab-sim check`."""

from rich.console import Console
from rich.table import Table

from ab_sim.drive import Drive
from ab_sim.dynamics.assemble import linear_rates
from ab_sim.errors import InputError, nearest
from ab_sim.integrate.limits import largest_step
from ab_sim.scene import find_scene, load_scene, scene_names
from ab_sim.scene.registry import effect_classes, effect_parameters

# Scenes hold other people's text, and units stand in brackets: nothing here is markup.
console = Console(markup=False)


def print_scenes() -> None:
    """Name, what it is and where it comes from, of every scene in the package."""
    table = Table("scene", "balls", "what it is", "source")
    for name in scene_names():
        scene = load_scene(name)
        table.add_row(name, str(scene.balls.count), scene.description, scene.source)
    console.print(table)


def print_effects(only: str | None = None) -> None:
    """Every effect, or only one, with its meaning, equation, source and parameters.

    Raises:
        InputError: there is none of that name; names the known ones and the nearest.
    """
    known = effect_classes()
    if only is not None and only not in known:
        raise InputError(
            f"{only!r}: no such effect{nearest(only, known)}; known are: {', '.join(known)}"
        )
    for name, effect in known.items() if only is None else [(only, known[only])]:
        table = Table(title=name, title_justify="left", title_style="bold", show_header=False)
        table.add_row("meaning", " ".join((effect.__doc__ or "").split()))
        table.add_row("equation", effect.equation)
        table.add_row("source", effect.source)
        for key, field in effect_parameters(effect).items():
            default = f"; default {_short(field['default'])}" if "default" in field else ""
            table.add_row(key, f"{field['description']} [{field['unit']}]{default}")
        if not effect_parameters(effect):
            table.add_row("parameters", "none")
        if effect.uses_ball_radius:
            table.add_row("also uses", "balls.radius")
        console.print(table)


def _short(value: float | None) -> str:
    return "none" if value is None else f"{value:g}"


def print_check(name: str, changes: list[str]) -> None:
    """What a scene would simulate."""
    scene = load_scene(name, changes)
    drive = Drive(scene)
    table = Table(title=f"{scene.name} is a valid scene", show_header=False)
    table.add_row("file", str(find_scene(name)))
    table.add_row("balls", str(scene.balls.count))
    table.add_row("effects", ", ".join(scene.effects) or "none")
    if scene.critical_speed is not None:
        table.add_row("critical speed", f"{scene.critical_speed:.4g} rad/s")
    unbalance = scene.eccentric_mass * scene.rotor.eccentricity
    if scene.balls.count and unbalance > 0:
        reach = scene.balls.total_mass * scene.race.radius / unbalance
        table.add_row("balls' unbalance / rotor's", f"{reach:.4g}")
    table.add_row("profile", "none" if scene.profile is None else scene.profile.kind)
    table.add_row("stepper", f"{drive.stepper.name} (order {drive.stepper.order})")
    rates = linear_rates(drive.system, scene.spindle.max_speed)
    most, what = largest_step(drive.stepper, rates)
    limit = f", at most {most:g} s for {what}" if what else ""
    table.add_row("step", f"{drive.step:g} s{limit}")
    for assumption in scene.assumed:
        table.add_row("assumed", assumption)
    console.print(table)
