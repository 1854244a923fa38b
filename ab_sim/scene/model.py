"""A scene as a whole, and the conditions between its sections."""

import math
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np
from pydantic import Field, model_validator

from ab_sim.base.errors import exact, nearest
from ab_sim.scene.profiles import AdaptiveProfile, Profile, beyond, check_profile, planned
from ab_sim.scene.quantities import Inertia, Number, Section, quantity
from ab_sim.scene.registry import deck_model_ways
from ab_sim.scene.sections import (
    Accuracy,
    Balanced,
    Balls,
    Deck,
    Mount,
    OneLine,
    Race,
    Rotor,
    Solver,
    Spindle,
    Start,
    Words,
    inertia_matrix,
)
from ab_sim.scene.sensors import Probes, Sampled, Sensors

_IN_PLANE = ("deck_force", "space_force")
IN_SPACE = ("mount_stiffening",)
"""Methods by which effects act on a deck in the plane of the disc, and on one in space."""
Condition = tuple[Any, Callable[[], str]]
"""Result of a condition, a bool or a mask of runs, and a function that returns the message of a
single scene that violates it."""


class Scene(Section):
    """One drive, its effects and sensors, its start and its spindle-speed profile.

    Created by ``ab_sim.load_scene``. Values are in SI, whatever the units in the file, and
    immutable.

    Examples
    --------
    >>> import ab_sim
    >>> scene = ab_sim.load_scene("thesis-hold")
    >>> scene
    <Scene thesis-hold: balls 2, effects ball_spin rolling_friction ..., duration 6 s>
    >>> scene.race.radius, scene.effects["suspension"].stiffness
    (0.01, 1000.0)
    """

    name: OneLine = Field(
        default="", description="name of the scene, one line; default: the file's name"
    )
    description: Words = Field(default="", description="description for readers")
    source: Words = Field(default="", description="source of the values, for readers")
    assumed: tuple[Words, ...] = Field(
        default=(), description="assumptions that the source does not state, one sentence each"
    )
    rotor: Rotor
    deck: Deck | None = None
    """Deck in space; without it, the deck moves in the plane of the disc."""
    mounts: tuple[Mount, ...] = Field(
        default=(), description="rubber mounts that hold a deck in space; any number"
    )
    deck_model: OneLine | None = Field(
        default=None,
        description="name of the deck's equations; default: those of a deck in space if the "
        "scene has a section deck, else those of a deck in the plane of the disc",
    )
    race: Race = Race(radius=0.01)
    """Race; required with balls. Without balls, its radius is only the scale of pictures."""
    balls: Balls
    effects: dict[str, Any] = Field(
        description="effects that act on the motion: a list of names, each with its "
        "parameters (`ab-sim effects` prints them); other effects are not "
        "computed; [] for none"
    )
    sensors: Sensors = Field(
        default={},
        description="accelerometers by name, each with its parameters (`ab-sim sensors` "
        "prints them), e.g. {accelerometer: {bandwidth: 200}}",
    )
    probes: Probes = Field(
        default={},
        description="proximity probes, which read the deck's displacement, by name, each with "
        "its parameters (`ab-sim sensors` prints them), e.g. {probe: {bandwidth: "
        "200}}",
    )
    start: Start = Start()
    spindle: Spindle
    profile: Profile | None = Field(
        default=None, description="requested speed over time; default: live commands set the speed"
    )
    accuracy: Accuracy | None = None
    solver: Solver = Solver()
    """Solver. If an accuracy is requested, ``resolve_accuracy`` chooses the solver instead."""
    balanced: Balanced | None = None
    """Criterion of the metric ``balanced``; None for the default criterion."""
    duration: Number = quantity("duration of a run", "s", gt=0, le=1e6)

    @property
    def pickups(self) -> dict[str, Sampled]:
        """Return all sensors in the order of their channels, accelerometers before probes."""
        return {**self.sensors, **self.probes}

    @property
    def total_mass(self) -> float:
        """Return the total mass M on the suspension [kg], balls included."""
        if self.rotor.total_mass is not None:
            return self.rotor.total_mass
        assert self.rotor.mass is not None
        return self.rotor.mass + self.balls.total_mass

    @property
    def eccentric_mass(self) -> float:
        """Return M0, the mass whose centre is off the shaft axis by the eccentricity e [kg]."""
        if self.rotor.eccentric_mass is not None:
            return self.rotor.eccentric_mass
        return self.total_mass - self.balls.total_mass

    @property
    def couple_unbalance(self) -> complex:
        """Return the rotor's couple unbalance, the integral of (x + i y) z dm [kg m^2].

        x points at the unbalance, and z counts from C. The result is 0 for a deck in the plane,
        where heights have no meaning.
        """
        if self.rotor.inertia is None:
            return 0.0
        inertia = inertia_matrix(self.rotor.inertia)
        lifted = self.eccentric_mass * self.rotor.eccentricity * self.rotor.height
        return complex(lifted - inertia[0, 2], -inertia[1, 2])

    @property
    def critical_speed(self) -> float | None:
        """Return the critical speed sqrt(k/M) [rad/s] (thesis (2-14)); None without suspension."""
        suspension = self.effects.get("suspension")
        return None if suspension is None else math.sqrt(suspension.stiffness / self.total_mass)

    @property
    def whirl_unit(self) -> tuple[float, str]:
        """Return the length [m] that is the unit of whirl errors, and its symbol.

        It is the eccentricity e, or the race's radius R if e = 0.
        """
        e = self.rotor.eccentricity
        return (e, "e") if e > 0 else (self.race.radius, "R")

    @property
    def is_controlled(self) -> bool:
        """Return whether measurements during the run decide the speed."""
        return planned(self.profile) != self.profile

    @property
    def planned(self) -> "Scene":
        """Return the scene with a profile that needs no measurements, see ``profiles.planned``."""
        return self.model_copy(update={"profile": planned(self.profile)})

    def __repr__(self) -> str:
        effects = " ".join(self.effects) or "none"
        return (
            f"<Scene {self.name}: balls {self.balls.count}, effects {effects}, "
            f"duration {self.duration:g} s>"
        )

    __str__ = __repr__

    def as_mapping(self) -> dict[str, object]:
        """Return the scene as nested plain values.

        ``check_scene`` turns them into an equal scene.
        """
        return self.with_plain(type(self).model_fields)

    def with_plain(self, keys: Iterable[str]) -> dict[str, object]:
        """Return the values of the scene by key; those of ``keys`` are converted to plain values.

        Missing values are left out, and so is the solver if an accuracy is requested.
        """
        values = {
            key: value
            for key in type(self).model_fields
            if (value := getattr(self, key)) is not None
        }
        if self.accuracy is not None:
            del values["solver"]
        if "race" not in self.model_fields_set:
            del values["race"]
        wanted = values.keys() & keys
        values |= self.model_dump(mode="json", exclude_none=True, include=wanted - {"effects"})
        if "effects" in wanted:
            values["effects"] = {name: effect._asdict() for name, effect in self.effects.items()}
        return values

    @model_validator(mode="after")
    def _consistent(self) -> "Scene":
        _check_lists(self)
        for holds, message in conditions(self):
            if not holds:
                raise ValueError(message())
        for check in (
            _check_profile,
            _check_accuracy,
            _check_sensors,
            _check_start,
            _check_deck_model,
            _check_deck,
        ):
            check(self)
        for effect in self.effects.values():
            check_scene = getattr(effect, "check_scene", None)
            if check_scene is not None:
                check_scene(self)
        return self


def _check_lists(scene: Scene) -> None:
    """Refuse a list with one entry per ball that has another length."""
    balls, angles = scene.balls, scene.start.ball_angles
    for key, values, what, instead in (
        ("balls.mass", balls.mass, "masses", "or one number for all"),
        ("balls.radius", balls.radius, "radii", "or one number for all"),
        ("start.ball_angles", angles, "angles", "or leave it out to start apart"),
        ("start.ball_rates", scene.start.ball_rates, "rates", "or leave it out to start at rest"),
        ("balls.race", balls.race, "races", "or one number for all"),
    ):
        if isinstance(values, tuple) and len(values) != balls.count:
            raise ValueError(
                f"{key}: has {len(values)} {what} for {balls.count} balls (balls.count); "
                f"give one per ball, {instead}"
            )


def conditions(scene: Scene) -> Iterator[Condition]:
    """Yield the conditions between masses and radii; the numbers may be columns of runs.

    After a condition that does not hold, the next ones may have no meaning.
    """
    yield from _of_masses(scene)
    yield from _of_radii(scene)


def _of_masses(scene: Scene) -> Iterator[Condition]:
    """Yield the conditions that the needed masses are given, and do not contradict each other."""
    rotor, balls, e = scene.rotor, scene.balls, scene.rotor.eccentricity
    yield (
        (e == 0) | (e >= 1e-12),
        lambda: f"rotor.eccentricity = {exact(e)} m: must be 0 or at least 1e-12",
    )
    yield (
        (rotor.total_mass is None) != (rotor.mass is None),
        lambda: "rotor: give exactly one of total_mass (balls included) and mass (without balls)",
    )
    yield (
        not balls.count or balls.mass is not None,
        lambda: f"balls.mass: is needed, the scene has {balls.count} balls",
    )
    rest = scene.total_mass - balls.total_mass
    yield (
        rest > 0,
        lambda: (
            f"rotor.total_mass = {exact(scene.total_mass)} kg: must be more than the {balls.count} "
            f"balls' {exact(balls.total_mass)} kg that it includes"
        ),
    )
    yield (
        scene.eccentric_mass <= rest * (1 + 1e-12),
        lambda: (
            f"rotor.eccentric_mass = {exact(scene.eccentric_mass)} kg: must be at most the "
            f"{exact(rest)} kg that move on the suspension besides the balls"
        ),
    )


def _of_radii(scene: Scene) -> Iterator[Condition]:
    """Yield the conditions that race and radii are given, and that the balls fit into the race."""
    balls, race = scene.balls, scene.race.radius
    yield (
        not balls.count or "race" in scene.model_fields_set,
        lambda: "race: is missing; add it: the balls need one, e.g. race: {radius: 0.01}",
    )
    effects = scene.effects.items()
    users = [name for name, effect in effects if getattr(effect, "uses_ball_radius", False)]
    yield (
        balls.radius is not None or not (users and balls.count),
        lambda: f"balls.radius: is needed by the effect {users[0]}",
    )
    radii: dict[str, Any] = {"balls.radius": balls.radius or 0.0}
    if isinstance(balls.radius, tuple):
        radii = {f"balls.radius.{ball}": radius for ball, radius in enumerate(balls.radius)}
    yield (
        race > max(radii.values(), default=0.0),
        lambda: next(
            f"{key} = {exact(radius)} m: must be less than race.radius = {exact(race)} m"
            for key, radius in radii.items()
            if radius >= race
        ),
    )


def _check_profile(scene: Scene) -> None:
    """Refuse a start speed or a profile beyond the spindle's limits."""
    spindle, first = scene.spindle, scene.start.speed
    if abs(first) > spindle.max_speed:
        raise ValueError(beyond("start.speed", first, spindle.max_speed))
    if scene.profile is not None:
        check_profile(scene.profile, first, spindle.max_speed, spindle.max_acceleration)


def _check_start(scene: Scene) -> None:
    """Refuse a start state that does not suit the deck, or that needs a missing motor."""
    start, ways = scene.start.deck, 2 if scene.deck is None else 3
    for key in ("position", "velocity"):
        value = getattr(start, key)
        if value is not None and len(value) != ways:
            raise ValueError(
                f"start.deck.{key} = {list(value)}: has {len(value)} numbers, and the deck moves "
                f"along {ways} axes"
            )
    for key in ("tilt", "tilt_rate"):
        if scene.deck is None and getattr(start, key) is not None:
            raise ValueError(
                f"start.deck.{key}: the deck moves in the plane of the disc and does not tilt; "
                "remove it, or describe the deck in space (sections deck and mounts)"
            )
    integral, effects = scene.start.motor_integral, scene.effects.values()
    if integral and not any(hasattr(effect, "rotor_moment") for effect in effects):
        raise ValueError(
            f"start.motor_integral = {exact(integral)} rad: needs a motor, and the scene has "
            "none; remove it, or name the effect motor"
        )
    if start.tilt is not None and abs(math.cos(start.tilt[0])) < 1e-6:
        raise ValueError(
            f"start.deck.tilt = {list(start.tilt)} rad: at alpha = +-pi/2 the angles beta and "
            "gamma turn about the same axis; tilt the deck a little less"
        )


def _check_deck_model(scene: Scene) -> None:
    """Refuse a deck model that is unknown, or is for another kind of deck than the scene's."""
    name, in_space = scene.deck_model, scene.deck is not None
    if name is None:
        return
    ways = deck_model_ways()
    if name not in ways:
        raise ValueError(
            f"deck_model = {name!r}: no such deck model{nearest(name, ways)}; known are: "
            + ", ".join(ways)
        )
    if in_space == (ways[name] > 2):
        return
    if in_space:
        raise ValueError(
            f"deck_model = {name!r}: moves in the plane of the disc, and the scene has a deck in "
            "space (deck); remove one of the two"
        )
    raise ValueError(
        f"deck_model = {name!r}: moves in space; describe the deck (sections deck and mounts), or "
        "remove it"
    )


def _check_accuracy(scene: Scene) -> None:
    """Refuse a requested accuracy together with a solver, or for balls that do not exist."""
    if scene.accuracy is None:
        return
    if "solver" in scene.model_fields_set:
        raise ValueError(
            "accuracy: chooses stepper and step, so the scene must not have a section solver, too; "
            "remove one of the two sections"
        )
    if scene.accuracy.angle is not None and scene.balls.count == 0:
        raise ValueError(
            f"accuracy.angle = {scene.accuracy.angle:g} rad: is for ball angles, and the scene has "
            "no balls (balls.count); request accuracy.whirl"
        )


def _check_sensors(scene: Scene) -> None:
    """Refuse sensors that do not suit the step or the profile, or that share a name."""
    step = None if scene.accuracy is not None else scene.solver.step
    if both := scene.sensors.keys() & scene.probes.keys():
        raise ValueError(
            f"probes.{min(both)}: a sensor (section sensors) has this name, too; rename one of them"
        )
    for section, pickups in (("sensors", scene.sensors), ("probes", scene.probes)):
        for name, pickup in pickups.items():
            pickup.check(f"{section}.{name}", step)
    if isinstance(scene.profile, AdaptiveProfile):
        scene.profile.check_sensors(scene.pickups, step)


def _check_deck(scene: Scene) -> None:
    """Refuse sections that have no meaning for the scene's kind of deck, and impossible values.

    Raises
    ------
    ValueError
        A section or an effect does not apply, or a value is impossible; the message names key,
        value, allowed range and remedy.
    """
    if scene.deck is None:
        _check_plane(scene)
        return
    rotor, heights = scene.rotor, scene.race.heights
    if rotor.inertia is None:
        raise ValueError("rotor.inertia: is needed, the scene has a deck in space (deck)")
    if rotor.eccentric_mass is None:
        raise ValueError(
            "rotor.eccentric_mass: is needed, the scene has a deck in space (deck): the mass of "
            "rotor and disc, whose centre is off the shaft axis by rotor.eccentricity"
        )
    _check_inertia("deck.inertia", scene.deck.inertia)
    _check_inertia("rotor.inertia", rotor.inertia)
    for k, mount in enumerate(scene.mounts):
        for key, value in (("stiffness", mount.stiffness), ("damping", mount.damping)):
            if isinstance(value, tuple) and len(value) != 3:
                raise ValueError(
                    f"mounts.{k}.{key}: has {len(value)} numbers; give one, or one for each of its "
                    "three axes"
                )
    if not heights:
        raise ValueError("race.height = []: give one number, or one for each race")
    for i, race in enumerate(scene.balls.races):
        if not 0 <= race < len(heights):
            key = f"balls.race.{i}" if isinstance(scene.balls.race, tuple) else "balls.race"
            raise ValueError(
                f"{key} = {race}: there is no such race; race.height has {len(heights)}, counted "
                "from 0"
            )
    _check_effects(scene, _IN_PLANE, IN_SPACE, "a deck in the plane", "the scene has one in space")


def _check_plane(scene: Scene) -> None:
    """Refuse values and effects that have a meaning for a deck in space only."""
    needless = {
        "mounts": bool(scene.mounts),
        "rotor.height": bool(scene.rotor.height),
        "rotor.inertia": scene.rotor.inertia is not None,
        "race.height": scene.race.height != 0.0,
        "balls.race": any(scene.balls.races),
        **{f"sensors.{name}.position": any(s.position) for name, s in scene.sensors.items()},
        **{f"probes.{name}.position": any(p.position) for name, p in scene.probes.items()},
    }
    for key, is_given in needless.items():
        if is_given:
            raise ValueError(
                f"{key}: has no meaning for a deck that moves in the plane of the disc; remove it, "
                "or describe the deck in space (sections deck and mounts)"
            )
    _check_effects(scene, IN_SPACE, _IN_PLANE, "a deck in space", "the scene has one in the plane")


def _check_effects(
    scene: Scene, others: tuple[str, ...], methods: tuple[str, ...], whose: str, here: str
) -> None:
    """Refuse effects that act only on a kind of deck that the scene does not have.

    Parameters
    ----------
    scene
        Scene to check.
    others
        Methods of effects that act on the other kind.
    methods
        Methods of effects that act on this kind.
    whose
        Other kind, for the message.
    here
        Statement on this scene, for the message.
    """
    for name, effect in scene.effects.items():
        acts_there = any(hasattr(effect, method) for method in others)
        if acts_there and not any(hasattr(effect, method) for method in methods):
            instead = "; describe the springs as mounts" if others == _IN_PLANE else ""
            raise ValueError(
                f"effects.{name}: acts on {whose} only, and {here}; remove it{instead}"
            )


def _check_inertia(key: str, inertia: Inertia) -> None:
    """Refuse an inertia that no rigid body has: the triangle inequality of principal moments."""
    least, middle, most = np.linalg.eigvalsh(inertia_matrix(inertia))
    if least < 0 or least + middle < most * (1 - 1e-9) or most <= 0:
        raise ValueError(
            f"{key} = {list(inertia)} kg m^2: no rigid body has it; the principal moments are "
            f"{least:.4g}, {middle:.4g}, {most:.4g}: none may be negative, or larger than the sum "
            "of the two others"
        )
