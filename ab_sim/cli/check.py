"""`ab-sim check`."""

from collections.abc import Iterable, Iterator

from rich.table import Table

from ab_sim.analysis.rest import rest_of
from ab_sim.base.errors import SceneError
from ab_sim.cli.outputs import results
from ab_sim.cli.progress import progress_bar
from ab_sim.cli.scene_commands import CheckOptions
from ab_sim.drive.accuracy import resolve_accuracy
from ab_sim.drive.overlap import WHAT_CHANGES, overlaps_at_start, together_at_start
from ab_sim.engine.integrate.choose import choose_stepper
from ab_sim.model.dynamics.assemble import free_coordinates, system_of
from ab_sim.model.dynamics.system import System
from ab_sim.model.equations.planar import Planar
from ab_sim.scene import Scene, find_scene, load_scene
from ab_sim.scene.sensors import steps_per_sample


def print_check(options: CheckOptions) -> None:
    """Print a summary of a scene without running it."""
    scene = load_scene(options.scene, options.change)
    work_precision = None
    if scene.accuracy is not None:
        with progress_bar(f"accuracy of {scene.name}") as tell:
            scene, work_precision = resolve_accuracy(scene, tell=tell)
    # A Drive would compile its kernel, which takes half a minute the first time.
    system = system_of(scene)
    choice = choose_stepper(scene, system)
    table = Table(title=f"{scene.name} is a valid scene", show_header=False)
    table.add_row("file", str(find_scene(options.scene)))
    table.add_row("balls", _balls(scene))
    table.add_row("effects", ", ".join(scene.effects) or "none")
    if scene.critical_speed is not None:
        table.add_row("critical speed", f"{scene.critical_speed:.4g} rad/s")
    if together := together_at_start(scene):
        table.add_row("balls together", together)
    if overlaps := overlaps_at_start(scene):
        table.add_row("balls overlap", f"{overlaps}; {WHAT_CHANGES}")
    unbalance = scene.eccentric_mass * scene.rotor.eccentricity
    if scene.balls.count and unbalance > 0:
        reach = scene.balls.total_mass * scene.race.radius / unbalance
        table.add_row("balls' unbalance / rotor's", f"{reach:.4g}")
    for row in (*_deck(scene, system), *_motor(scene), *_sensors(scene)):
        table.add_row(*row)
    table.add_row("profile", _profile(scene))
    stepper, reason, longest, limited_by, _ = choice
    if work_precision is not None:
        reason = "the cheapest measured to be accurate enough"
    table.add_row("stepper", f"{stepper.name} (order {stepper.order}), {reason}")
    limit = f", at most {longest:g} s for {limited_by}" if limited_by else ""
    table.add_row("step", f"{scene.solver.step:g} s{limit}")
    if work_precision is not None:
        table.add_row("accuracy", work_precision.reason)
    for assumption in scene.assumed:
        table.add_row("assumed", assumption)
    results.print(table)


def _profile(scene: Scene) -> str:
    profile, first = scene.profile, scene.start.speed
    if profile is None:
        return "none"
    if profile.kind == "adaptive":
        period = f"a command every {profile.command_period:g} s"
        return f"adaptive, reads {profile.sensor}, {period}"
    if profile.kind != "start_up" or profile.variable_speed_period is None:
        return profile.kind
    if profile.period_begins(first) is None:
        start = f"start.speed = {first:g} rad/s"
        return f"start_up; its variable-speed period is below {start}, and is omitted"
    return "start_up, with a variable-speed period"


def _balls(scene: Scene) -> str:
    masses = scene.balls.masses
    if not masses:
        return "0"
    if len(set(masses)) == 1:
        return f"{len(masses)} of {masses[0]:g} kg"
    return f"{len(masses)} of " + ", ".join(f"{mass:g}" for mass in masses) + " kg"


def _deck(scene: Scene, system: System) -> Iterator[tuple[str, str]]:
    """Yield rows on the deck's model and mounts."""
    if scene.deck_model is not None:
        yield "deck model", scene.deck_model
    if scene.deck is not None:
        mounts = len(scene.mounts)
        yield "deck", f"moves and tilts in space, on {mounts} mount{'' if mounts == 1 else 's'}"
        if len(heights := scene.race.heights) > 1:
            yield "races", f"{len(heights)}, at heights of {', '.join(f'{h:g}' for h in heights)} m"
    if free := free_coordinates(system):
        yield "deck is free", f"no stiffness holds it along: {', '.join(free)}"
    if "gravity" not in scene.effects:
        return
    if scene.deck is None:
        if isinstance(system.deck_model, Planar):
            sag = (system.deck_model.sag_x, system.deck_model.sag_y)
            yield "deck hangs at rest", _named("xy", sag, "m")
        return
    try:
        rest = rest_of(scene)
    except SceneError:
        yield "deck falls", "nothing holds its weight"
        return
    yield "deck hangs at rest", _named("xyz", rest.place, "m")
    yield "", _named(("alpha", "beta", "gamma"), rest.tilt, "rad")


def _named(names: Iterable[str], values: Iterable[float], unit: str) -> str:
    pairs = zip(names, values, strict=True)
    return ", ".join(f"{name} = {round(value, 12):.4g} {unit}" for name, value in pairs)


def _motor(scene: Scene) -> Iterator[tuple[str, str]]:
    """Yield rows on the motor's limits, and on the demands of profile and whirl."""
    motor = scene.effects.get("motor")
    if motor is None:
        return
    limit = f"at most {motor.torque_limit:g} N m at standstill"
    if motor.back_emf_slope > 0:
        top = motor.torque_limit / motor.back_emf_slope
        limit += f", zero at {top:.4g} rad/s"
    yield "motor", limit
    unbalance = scene.eccentric_mass * scene.rotor.eccentricity
    moment = motor.rotor_inertia + unbalance * scene.rotor.eccentricity
    moment += 0.0 if scene.rotor.inertia is None else scene.rotor.inertia[2]
    moment += scene.balls.total_mass * scene.race.radius**2
    acceleration = getattr(scene.profile, "acceleration", scene.spindle.max_acceleration)
    needs = f"{moment * acceleration:.3g} N m to accelerate at {acceleration:g} rad/s^2"
    balls = ", with the balls at rest on the race" if scene.balls.count else ""
    yield "motor needs", needs + balls
    suspension, critical = scene.effects.get("suspension"), scene.critical_speed
    if suspension is not None and critical is not None and suspension.damping > 0:
        # The damper's power c (W w)^2 at resonance, where W = M0 e w / c.
        whirling = unbalance**2 * critical**3 / suspension.damping
        yield "", f"{whirling:.3g} N m to whirl at the critical speed, without balls"


def _sensors(scene: Scene) -> Iterator[tuple[str, str]]:
    for name, sensor in scene.pickups.items():
        steps = steps_per_sample(sensor.sample_rate, scene.solver.step)
        every = "every step" if steps == 1 else f"every {steps} steps"
        rates = f"{sensor.sample_rate:g} samples/s, one {every}; low-pass {sensor.bandwidth:g} Hz"
        aliases = sensor.aliasing(scene.solver.step)
        what = "probe" if name in scene.probes else "sensor"
        yield f"{what} {name}", f"{rates}; {aliases}" if aliases else rates
