"""Sections of a scene whose deck moves and tilts in space; see equations/in_space.py."""

from collections.abc import Mapping
from typing import Annotated, Any, Protocol

import numpy as np
from pydantic import Field

from ab_sim.scene.probes import Probes
from ab_sim.scene.quantities import Inertia, Length, Number, PerBall, Vector, quantity
from ab_sim.scene.section import Section
from ab_sim.scene.sections import Balls, Race, Rotor
from ab_sim.scene.sensors import Sensors

Point = tuple[Length, Length, Length]
Stiffness = Annotated[Number, Field(ge=0, le=1e12)]
Damping = Annotated[Number, Field(ge=0, le=1e9)]

IN_PLANE = ("deck_force", "space_force")
IN_SPACE = ("mount_stiffening",)
"""Methods by which effects act on a deck in the plane of the disc, and on one in space."""


class Deck(Section):
    """The deck as a rigid body in space, without rotor and balls.

    Its mass is the mass on the suspension less `rotor.eccentric_mass` and the balls.

    Deck axes x, y, z lie at C, the point of the spindle axis from which heights count; z is the
    spindle axis.
    """

    center: Point = quantity("centre of mass from C, on deck axes", "m", default=(0.0, 0.0, 0.0))
    inertia: Inertia = quantity(
        "inertia about the centre of mass, on deck axes: [xx, yy, zz] or [xx, yy, zz, xy, xz, "
        "yz]; xy is minus the integral of x y dm",
        "kg m^2",
    )


class Mount(Section):
    """A rubber mount between deck and housing: springs and dampers along three axes."""

    position: Point = quantity("position of the mount from C, on deck axes", "m")
    stiffness: PerBall[Stiffness] = quantity(
        "stiffness along the mount's axes: one number for all, or three", "N/m"
    )
    damping: PerBall[Damping] = quantity(
        "damping along the mount's axes: one number for all, or three", "N s/m"
    )
    turned: Vector = quantity(
        "rotation vector from the ground's axes to the mount's", "rad", default=(0.0, 0.0, 0.0)
    )


class WithDeck(Protocol):
    """The parts of a scene that concern its deck, in the plane or in space."""

    @property
    def deck(self) -> Deck | None:
        """Deck in space; None in the plane."""

    @property
    def mounts(self) -> tuple[Mount, ...]:
        """Mounts of a deck in space."""

    @property
    def rotor(self) -> Rotor:
        """Rotor with disc."""

    @property
    def race(self) -> Race:
        """One race, or several of one size."""

    @property
    def balls(self) -> Balls:
        """Balls in the races."""

    @property
    def effects(self) -> Mapping[str, Any]:
        """Effects by name."""

    @property
    def sensors(self) -> Sensors:
        """Sensors by name."""

    @property
    def probes(self) -> Probes:
        """Probes by name."""

    @property
    def total_mass(self) -> float:
        """Total mass [kg]."""


def check_deck(scene: WithDeck) -> None:
    """Refuse sections that have no meaning for this kind of deck, and impossible values.

    Raises:
        ValueError: a section or an effect does not apply, or a value is impossible; the message
            names key, value, allowed range and remedy.
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
    _check_effects(scene, IN_PLANE, IN_SPACE, "a deck in the plane", "the scene has one in space")


def _check_plane(scene: WithDeck) -> None:
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
    _check_effects(scene, IN_SPACE, IN_PLANE, "a deck in space", "the scene has one in the plane")


def _check_effects(
    scene: WithDeck, others: tuple[str, ...], methods: tuple[str, ...], whose: str, here: str
) -> None:
    for name, effect in scene.effects.items():
        acts_there = any(hasattr(effect, method) for method in others)
        if acts_there and not any(hasattr(effect, method) for method in methods):
            instead = "; describe the springs as mounts" if others is IN_PLANE else ""
            raise ValueError(
                f"effects.{name}: acts on {whose} only, and {here}; remove it{instead}"
            )


def _check_inertia(key: str, inertia: Inertia) -> None:
    least, middle, most = np.linalg.eigvalsh(inertia_matrix(inertia))
    if least < 0 or least + middle < most * (1 - 1e-9) or most <= 0:
        raise ValueError(
            f"{key} = {list(inertia)} kg m^2: no rigid body has it; the principal moments are "
            f"{least:.4g}, {middle:.4g}, {most:.4g}: none may be negative, or larger than the sum "
            "of the two others"
        )


def inertia_matrix(inertia: Inertia) -> np.ndarray:
    """Return an ``Inertia`` as a matrix [kg m^2], shape (3, 3)."""
    xx, yy, zz, xy, xz, yz = (*inertia, 0.0, 0.0, 0.0)[:6]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
