"""Five checks of each effect, and the scenes in which it acts.

A file in this folder, named after an effect, defines ``PARTS``, an instance of a subclass of
``FiveParts``. All assertions are about runs of ``watch``, which asserts that the effect is active
in them.
"""

import importlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.drive.observation import EnergyBalance
from ab_sim.drive.trajectory import Trajectory
from ab_sim.model.dynamics.system import DIRECTION
from ab_sim.scene import Scene, check_scene
from tests.conftest import MOTOR, THESIS, merge
from tests.overlap import assert_apart

Changes = dict[str, Any]

_UNEQUAL = {"stiffness_1": 1000.0, "stiffness_2": 1000.0, "damping_1": 0.2, "damping_2": 0.2}
_SMOOTH: Changes = {
    "suspension": None,
    "unequal_suspension": _UNEQUAL,
    "gravity": {"tilt": 0.0},
    "hardening_suspension": {"cubic_stiffness": 0.0},
    "race_runout": {},
}
_FRICTION: Changes = {"rolling_friction": {"arm": 0.0}, "race_friction": {"coefficient": 0.0}}
_CONTACT: Changes = {"ball_contact": {"restitution_coefficient": 0.5}}
COMPANIES: dict[str, Changes] = {
    "thesis": {},
    "smooth": _SMOOTH,
    "friction": {**_FRICTION, "gravity": {"tilt": 0.0}},
    "contact": _CONTACT,
    "motor": {"motor": MOTOR},
    "all": {**_SMOOTH, **_FRICTION, **_CONTACT, "motor": MOTOR},
}
"""Sets of effects in addition to those of the thesis; most have no influence at these values.

Each set of effects needs a long compilation, so that these few sets serve all tests.
"""
NO_LOSSES: Changes = {
    "thesis": {"suspension": {"damping": 0.0}, "viscous_drag": {"coefficient": 0.0}},
    "smooth": {
        "unequal_suspension": {"damping_1": 0.0, "damping_2": 0.0},
        "viscous_drag": {"coefficient": 0.0},
    },
}
NO_LOSSES |= {name: NO_LOSSES["thesis"] for name in ("friction", "contact", "motor")}
NO_LOSSES["all"] = NO_LOSSES["smooth"]
"""Changes that keep the effects of each company from dissipating."""

CRITICAL: Changes = {
    "start": {"speed": 90.0, "ball_angles": [0.3, -0.9]},
    "profile": {"kind": "start_up", "acceleration": 40.0, "target_speed": 400.0},
}
"""Passage of the critical speed, 100 rad/s, within 0.25 s, so that everything moves."""


def scene_of(company: str, *changes: Changes) -> Scene:
    """Return the thesis' drive near its critical speed with a company's effects and changes."""
    made = merge(merge(THESIS, CRITICAL), {"effects": COMPANIES[company]})
    for change in changes:
        made = merge(made, change)
    return check_scene(made, "test")


@dataclass(frozen=True)
class Run:
    """Run with its states and energies at twenty instants, the first at the start."""

    drive: Drive
    trajectory: Trajectory
    states: np.ndarray
    discrete_state: np.ndarray
    energies: tuple[EnergyBalance, ...]

    @property
    def scene(self) -> Scene:
        return self.drive.scene

    def effect(self, name: str) -> Any:
        return self.scene.effects[name]

    @property
    def time(self) -> np.ndarray:
        return self.trajectory["time"]

    def integral(self, rate: np.ndarray) -> float:
        """Return the integral over time of a channel that is zero at the start."""
        return float(np.trapezoid(np.append(0.0, rate), dx=self.drive.step))


def run(scene: Scene, steps: int, energy_balance: bool = True) -> Run:
    """Run a scene and keep states and energies at twenty instants."""
    drive = Drive(scene, energy_balance=energy_balance)
    kept, parts = [drive.snapshot()], []
    energies = [drive.energy()] if energy_balance else []
    for share in np.diff(np.linspace(0, steps, 20).astype(int)):
        parts.append(drive.advance(int(share)))
        kept.append(drive.snapshot())
        if energy_balance:
            energies.append(drive.energy())
    for part in parts:
        assert_apart(drive, part)
    states, discrete_state = (
        np.array([k.state for k in kept]),
        np.array([k.discrete_state for k in kept]),
    )
    return Run(drive, Trajectory.join(parts), states, discrete_state, tuple(energies))


class Slope(NamedTuple):
    """Time derivative of a state by its parts; see ``Layout``."""

    deck: np.ndarray
    angles: np.ndarray
    rates: np.ndarray
    spindle: np.ndarray

    def less(self, other: "Slope") -> "Slope":
        """Return the difference from another slope."""
        return Slope(*(here - there for here, there in zip(self, other, strict=True)))


def slope(scene: Scene, **where: Sequence[float]) -> Slope:
    """Return the time derivative of the state, from a step of 0.1 us.

    Parameters
    ----------
    scene
        Scene whose start is the state.
    where
        Other values for parts of the state, by their names in ``Slope``.
    """
    drive = Drive(scene, energy_balance=True)
    drive.step = 1e-7
    kept, layout = drive.snapshot(), drive.layout
    for part, values in where.items():
        kept.state[getattr(layout, part)] = values
    kept.discrete_state[: scene.balls.count, DIRECTION] = np.sign(kept.state[layout.rates])
    before = kept.state.copy()
    drive.restore(kept)
    drive.advance(1)
    rate = (drive.snapshot().state - before) / drive.step
    return Slope(*(rate[getattr(layout, part)] for part in Slope._fields))


def apart(one: Trajectory, other: Trajectory) -> float:
    """Return the largest difference of two runs: deck over the race's 10 mm, balls in radians."""
    deck = [one[axis] - other[axis] for axis in ("x", "y")]
    balls = one.ball_angles - other.ball_angles
    return float(max(np.abs(deck).max() / 0.01, np.abs(balls).max(initial=0.0)))


def missing(part: Callable[..., None]) -> Callable[..., None]:
    """Mark a check that each specification must define."""
    part.missing = True  # type: ignore[attr-defined]
    return part


class FiveParts:
    """Checks of an effect, defined by subclasses; rotation and power have defaults."""

    name: ClassVar[str]
    company: ClassVar[str]
    changes: ClassVar[Changes] = {}
    """Changes to the scene in which the effect acts."""
    steps: ClassVar[int] = 500
    least: ClassVar[float] = 0.01
    """Strength above which the effect counts as active."""
    dissipates: ClassVar[bool]
    loss_known: ClassVar[float] = 0.01
    """Relative error of ``loss``."""
    rounding: ClassVar[float] = 1e-9
    """Largest value of ``apart`` that rounding causes, amplified by the motion."""

    def __init__(self) -> None:
        self.witnessed = 0

    def strength(self, run: Run) -> float:
        """Return the strength of the effect in a run, relative to a quantity of comparison."""
        raise NotImplementedError

    def watch(self, *changes: Changes, least: float | None = None, steps: int = 0) -> Run:
        """Run a scene and assert that the effect is active in it."""
        seen = run(scene_of(self.company, self.changes, *changes), steps or self.steps)
        strength = self.strength(seen)
        assert strength > (self.least if least is None else least), f"{self.name} was not active"
        self.witnessed += 1
        return seen

    def slope(self, *changes: Changes, **where: Sequence[float]) -> Slope:
        """Return ``slope`` with the effects of the effect's company."""
        return slope(scene_of(self.company, self.changes, *changes), **where)

    def adds(self, idle: Changes, *changes: Changes, **where: Sequence[float]) -> Slope:
        """Return the effect's contribution to the slope, and assert that it is not zero."""
        without = self.slope(*changes, {"effects": idle}, **where)
        added = self.slope(*changes, **where).less(without)
        bodies = np.concatenate([added.deck, added.angles, added.rates])
        assert np.abs(bodies).max() > 1e-3, f"{self.name} adds nothing"
        self.witnessed += 1
        return added

    def activity(self) -> None:
        """Check that the effect is active."""
        self.watch()

    @missing
    def direction(self) -> None:
        """Check the direction of the effect's force."""

    def rotation(self) -> None:
        """Check that turning the whole scene turns the motion and changes nothing else."""
        alpha = 0.7
        one = self.watch()
        other = self.watch(turned_by(alpha, one.scene))
        before, after = one.trajectory, other.trajectory
        turned = (before["x"] + 1j * before["y"]) * np.exp(1j * alpha)
        wide = np.abs(turned).max()
        assert wide > 1e-6 and np.abs(turned - before["x"] - 1j * before["y"]).max() > 0.1 * wide
        assert np.abs(after["x"] + 1j * after["y"] - turned).max() < self.rounding * 0.01
        assert np.abs(after.ball_angles - before.ball_angles).max(initial=0.0) < self.rounding

    def power(self) -> None:
        """Check that the energy balance closes, and that the effect dissipates as stated."""
        seen = self.watch({"effects": NO_LOSSES[self.company]}, *self.alone())
        closes(seen)
        dissipated = np.array([energy.dissipated for energy in seen.energies])
        if not self.dissipates:
            assert np.all(dissipated == 0.0), "it conserves"
            assert abs(seen.energies[-1].motor_work) > 1e-6, "and the motor did work"
            return
        assert np.all(np.diff(dissipated) >= 0.0) and dissipated[-1] > 0.0
        assert dissipated[-1] == pytest.approx(self.loss(seen), rel=self.loss_known)

    def alone(self) -> tuple[Changes, ...]:
        """Return changes that make the effect the only one that dissipates, after NO_LOSSES."""
        return ()

    def loss(self, run: Run) -> float:
        """Return the energy that the effect dissipated [J], from the samples and its law."""
        raise NotImplementedError

    @missing
    def limit(self) -> None:
        """Check that the model with vanishing parameters approaches that without the effect."""

    def vanishes(
        self,
        with_size: Callable[[float], Changes],
        *changes: Changes,
        without: Changes,
        company: str = "thesis",
        to: float = 0.1,
        within: float = 0.1,
        steps: int = 0,
    ) -> None:
        """Check that the difference from a run without the effect is proportional to its size.

        Parameters
        ----------
        with_size
            Function from a size to changes of the scene.
        changes
            Changes of both runs.
        without
            Effects that the other run lacks (None) or has instead.
        company
            Company of the other run.
        to
            Second size; the first one is 1.
        within
            Relative tolerance of the proportionality.
        steps
            Number of steps; 0 for the usual number.
        """
        energy_balance = all(value is not None for value in without.values())
        scene = scene_of(company, *changes, {"effects": without})
        other = run(scene, steps or self.steps, energy_balance).trajectory
        gaps = [
            apart(self.watch(*changes, with_size(size), least=0.0, steps=steps).trajectory, other)
            for size in (1.0, to)
        ]
        assert 0.3 > gaps[0] and gaps[1] > 1e-11, gaps
        assert gaps[1] == pytest.approx(to * gaps[0], rel=within)


def closes(run: Run, within: float = 1e-10) -> None:
    """Assert stored = at start + motor work - dissipated at each stored instant."""
    moved = max(abs(e.stored - e.at_start) + abs(e.motor_work) for e in run.energies)
    for e in run.energies:
        assert abs(e.stored - e.at_start - e.motor_work + e.dissipated) < within * moved


def turned_by(alpha: float, scene: Scene) -> Changes:
    """Return changes that turn a scene, with all directions in space."""
    effects: Changes = {}
    for name, key in (("gravity", "direction"), ("unequal_suspension", "axis_angle")):
        if name in scene.effects:
            effects[name] = {key: getattr(scene.effects[name], key) + alpha}
    return {"start": {"angle": scene.start.angle + alpha}, "effects": effects}


PART_NAMES = ("activity", "direction", "rotation", "power", "limit")


def parts_of(name: str) -> FiveParts:
    """Return the specification of an effect.

    Raises
    ------
    ModuleNotFoundError
        The effect has no specification.
    """
    found: FiveParts = importlib.import_module(f"tests.effects.{name}").PARTS
    found.witnessed = 0
    return found


def lacking(names: Iterable[str], find: Callable[[str], Any] = parts_of) -> list[str]:
    """Return the missing checks of effects, as texts."""
    found = []
    for name in names:
        try:
            parts = find(name)
        except ModuleNotFoundError:
            found.append(f"{name}: no file tests/effects/{name}.py")
            continue
        if parts.name != name:
            found.append(f"{name}: its file speaks of {parts.name}")
        if type(parts).strength is FiveParts.strength:
            found.append(f"{name}: activity")
        for part in PART_NAMES:
            shown = getattr(parts, part, None)
            if shown is None or getattr(shown, "missing", False):
                found.append(f"{name}: {part}")
    return found
