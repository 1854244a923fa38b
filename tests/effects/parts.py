"""What every effect has to show, in five parts, and the scenes in which it does.

A file here, named as the effect is, makes ``PARTS``, an instance of a subclass of ``FiveParts``.
Whatever is asserted is asserted of runs that ``watch`` made, and ``watch`` asserts that the effect
was active in them.
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
from tests.conftest import THESIS, merge
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
_MOTOR: Changes = {
    "motor": {
        "rotor_inertia": 2e-5,
        "torque_limit": 1e-2,
        "proportional_gain": 1e-3,
        "integral_gain": 1e-2,
        "back_emf_slope": 1e-6,
    }
}
COMPANIES: dict[str, Changes] = {
    "thesis": {},
    "smooth": _SMOOTH,
    "friction": {**_FRICTION, "gravity": {"tilt": 0.0}},
    "contact": _CONTACT,
    "motor": _MOTOR,
    "all": {**_SMOOTH, **_FRICTION, **_CONTACT, **_MOTOR},
}
"""Sets of effects beside the thesis', at parameters at which most do nothing.

Every set of effects is compiled for itself, which takes long: so these few serve all tests.
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
"""By company: what keeps the thesis' effects from dissipating."""

CRITICAL: Changes = {
    "start": {"speed": 90.0, "ball_angles": [0.3, -0.9]},
    "profile": {"kind": "start_up", "acceleration": 40.0, "target_speed": 400.0},
}
"""Through the critical speed, 100 rad/s, within a quarter of a second: all that moves, moves."""


def scene_of(company: str, *changes: Changes) -> Scene:
    """The thesis' drive near its critical speed in a company, with changes laid over it."""
    made = merge(merge(THESIS, CRITICAL), {"effects": COMPANIES[company]})
    for change in changes:
        made = merge(made, change)
    return check_scene(made, "test")


@dataclass(frozen=True)
class Run:
    """A run, with what it was at twenty instants; the first is the start."""

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
        """Of a channel that is zero at the start."""
        return float(np.trapezoid(np.append(0.0, rate), dx=self.drive.step))


def run(scene: Scene, steps: int, energy_balance: bool = True) -> Run:
    """Run a scene."""
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
    """Time derivative of a state, by what it is of; see ``Layout``."""

    deck: np.ndarray
    angles: np.ndarray
    rates: np.ndarray
    spindle: np.ndarray

    def less(self, other: "Slope") -> "Slope":
        """What it is beyond another one."""
        return Slope(*(here - there for here, there in zip(self, other, strict=True)))


def slope(scene: Scene, **where: Sequence[float]) -> Slope:
    """Time derivative of the state, over a tenth of a microsecond.

    Args:
        scene: its start is where this is, but for what follows.
        where: parts of the state that are something else, by their names in ``Slope``.
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
    """How far two runs are from each other: deck by the race's 10 mm, balls in radians."""
    deck = [one[axis] - other[axis] for axis in ("x", "y")]
    balls = one.ball_angles - other.ball_angles
    return float(max(np.abs(deck).max() / 0.01, np.abs(balls).max(initial=0.0)))


def missing(part: Callable[..., None]) -> Callable[..., None]:
    """Mark a part that a specification has to bring along."""
    part.missing = True  # type: ignore[attr-defined]
    return part


class FiveParts:
    """What an effect shows. A file's subclass says how; rotation and power have a usual way."""

    name: ClassVar[str]
    company: ClassVar[str]
    changes: ClassVar[Changes] = {}
    """The scene in which it acts."""
    steps: ClassVar[int] = 500
    least: ClassVar[float] = 0.01
    """How strong it has to be to count as active."""
    dissipates: ClassVar[bool]
    loss_known: ClassVar[float] = 0.01
    """How well ``loss`` knows it, relative."""
    rounding: ClassVar[float] = 1e-9
    """What of ``apart`` is rounding, grown with the motion."""

    def __init__(self) -> None:
        self.witnessed = 0

    def strength(self, run: Run) -> float:
        """How active it was in a run, as a share of what it is compared with."""
        raise NotImplementedError

    def watch(self, *changes: Changes, least: float | None = None, steps: int = 0) -> Run:
        """A run in which the effect is asserted to be active."""
        seen = run(scene_of(self.company, self.changes, *changes), steps or self.steps)
        strength = self.strength(seen)
        assert strength > (self.least if least is None else least), f"{self.name} was not active"
        self.witnessed += 1
        return seen

    def slope(self, *changes: Changes, **where: Sequence[float]) -> Slope:
        """``slope`` in the effect's company."""
        return slope(scene_of(self.company, self.changes, *changes), **where)

    def adds(self, idle: Changes, *changes: Changes, **where: Sequence[float]) -> Slope:
        """What the effect adds to the slope: asserted to be something."""
        without = self.slope(*changes, {"effects": idle}, **where)
        added = self.slope(*changes, **where).less(without)
        bodies = np.concatenate([added.deck, added.angles, added.rates])
        assert np.abs(bodies).max() > 1e-3, f"{self.name} adds nothing"
        self.witnessed += 1
        return added

    def activity(self) -> None:
        """It was active in the window."""
        self.watch()

    @missing
    def direction(self) -> None:
        """Its force points the right way."""

    def rotation(self) -> None:
        """Turn the whole scene: the motion turns with it and is otherwise the same."""
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
        """Nothing else dissipates: the balance closes, and it dissipates or does not."""
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
        """What makes the effect the only one that dissipates, beyond NO_LOSSES."""
        return ()

    def loss(self, run: Run) -> float:
        """What it dissipated [J], from the samples and its law."""
        raise NotImplementedError

    @missing
    def limit(self) -> None:
        """Parameters that vanish leave the model without it."""

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
        """The run at size 1, and at ``to``, differs from that without, in proportion to the size.

        Args:
            with_size: the scene's changes for a size.
            changes: in the run without the effect, too.
            without: effects that the other run has not (None) or has instead.
            company: in which the other run is made.
            to: the second size.
            within: how close to proportion, relative.
            steps: how many, if not as many as always.
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
    """Stored = at start + motor work - dissipated, at each instant looked at."""
    moved = max(abs(e.stored - e.at_start) + abs(e.motor_work) for e in run.energies)
    for e in run.energies:
        assert abs(e.stored - e.at_start - e.motor_work + e.dissipated) < within * moved


def turned_by(alpha: float, scene: Scene) -> Changes:
    """Changes that turn a scene, with all in it that has a direction in space."""
    effects: Changes = {}
    for name, key in (("gravity", "direction"), ("unequal_suspension", "axis_angle")):
        if name in scene.effects:
            effects[name] = {key: getattr(scene.effects[name], key) + alpha}
    return {"start": {"angle": scene.start.angle + alpha}, "effects": effects}


PART_NAMES = ("activity", "direction", "rotation", "power", "limit")


def parts_of(name: str) -> FiveParts:
    """The specification of an effect.

    Raises:
        ModuleNotFoundError: there is none.
    """
    found: FiveParts = importlib.import_module(f"tests.effects.{name}").PARTS
    found.witnessed = 0
    return found


def lacking(names: Iterable[str], find: Callable[[str], Any] = parts_of) -> list[str]:
    """What the effects of these names lack of their five parts, in words."""
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
