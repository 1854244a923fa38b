"""Measure the CPU time per step of each effect and sensor of a scene, alone and together."""

import contextlib
import datetime
import math
import os
import platform
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

import llvmlite
import numpy as np
import psutil

from ab_sim.base.errors import DivergedError, InputError, SceneError
from ab_sim.base.presentation import Column, Columns, Presented, Progress
from ab_sim.base.version import __version__
from ab_sim.drive import Drive
from ab_sim.drive.accuracy import resolve_accuracy
from ab_sim.engine.integrate.choose import choose_stepper
from ab_sim.model.dynamics.assemble import system_of
from ab_sim.model.equations.neighbours import start_angles
from ab_sim.scene.load import SceneLike, as_scene, check_scene
from ab_sim.scene.model import Scene

BASE, ALL = "no effects", "the scene's set"
"""Names of the variants without effects, and with all effects and sensors."""
_MOST_STEPS = 10_000
"""Maximum number of steps of a timed run."""
REPEATS = 15
"""Default number of rounds in which all variants are timed."""
_OFF_AXIS = 2.5
"""Angle by which all balls are shifted if one starts at exactly 0 [rad].

The cosine of exactly 0 takes less time than others. A ball that nothing moves would stay there, and
an effect that moves it would seem to cost the difference."""


@dataclass(frozen=True)
class Variant:
    """Scene with some of its effects and sensors."""

    name: str
    """Name in tables: the measured effect or sensor, or ``BASE`` or ``ALL``."""
    scene: Scene
    added: tuple[str, ...] = ()
    """Further enabled effects, without which the measured effect is invalid."""


class Quartiles(NamedTuple):
    """Median, quartiles and minimum of interleaved repeats."""

    median: float
    lower: float
    """Lower quartile; a quarter of the repeats is below it."""
    upper: float
    """Upper quartile; a quarter of the repeats is above it."""
    least: float
    """Least value of all repeats."""

    @classmethod
    def of(cls, values: np.ndarray) -> "Quartiles":
        """Return the quartiles of repeats, shape (repeats,)."""
        lower, median, upper = (float(x) for x in np.percentile(values, [25, 50, 75]))
        return cls(median, lower, upper, float(values.min()))


@dataclass(frozen=True)
class VariantCost:
    """Measured cost of a variant."""

    name: str
    """Name of the variant, see ``Variant``."""
    effects: tuple[str, ...]
    """Effects that are enabled."""
    sensors: tuple[str, ...]
    """Sensors that are enabled."""
    added: tuple[str, ...]
    """Further enabled effects, without which the measured effect is invalid."""
    ns_per_step: Quartiles | None
    """CPU time per step [ns]; None if the variant cannot run, for the reason in ``failure``."""
    ratio: Quartiles | None
    """CPU time per step over that of the variant without effects, by repeat."""
    events_per_1000_steps: float
    """Number of located events per 1000 steps."""
    first_seconds: float
    """Time until the first step is done [s]: construction of the drive and its machine code."""
    failure: str = ""
    """Error message of a variant that cannot run; otherwise empty."""


@dataclass(frozen=True, repr=False)
class EffectCost(Presented):
    """Costs of a scene's effects and sensors; see ``ab_sim.effect_cost``."""

    _picture = "effect_cost"

    scene: str
    """Name of the scene."""
    balls: int
    """Number of balls."""
    stepper: str
    """Name of the stepper of all variants."""
    step: float
    """Step [s]."""
    turned: float
    """Angle added to the scene's start angles of all balls [rad]."""
    steps_per_run: int
    """Number of steps of a timed run."""
    repeats: int
    """Number of rounds in which all variants were timed."""
    rows: tuple[VariantCost, ...]
    """Costs of the variants, one row each."""

    def _facts(self) -> dict[str, str]:
        times = [row.ns_per_step.median for row in self.rows if row.ns_per_step is not None]
        return {
            "scene": self.scene,
            "balls": str(self.balls),
            "stepper": f"{self.stepper} at {self.step:g} s",
            "ns per step": f"{min(times):.4g} to {max(times):.4g}" if times else "-",
        }

    def _columns(self) -> Columns:
        times, ratios = ([r.ns_per_step for r in self.rows], [r.ratio for r in self.rows])
        return {
            "effects": Column(None, [row.name for row in self.rows]),
            "ns_per_step": Column("ns", [None if t is None else t.median for t in times]),
            "of_base": Column("1", [None if ratio is None else ratio.median for ratio in ratios]),
            "events_per_1000_steps": Column("1", [row.events_per_1000_steps for row in self.rows]),
            "first_step": Column("s", [row.first_seconds for row in self.rows]),
            "failure": Column(None, [row.failure for row in self.rows]),
        }

    def table(self) -> dict[str, object]:
        """Return the results as JSON-able values."""
        table: dict[str, Any] = asdict(self)
        for row, result in zip(table["rows"], self.rows, strict=True):
            for key in ("ns_per_step", "ratio"):
                spread = getattr(result, key)
                row[key] = None if spread is None else spread._asdict()
        return table

    def report(self) -> dict[str, object]:
        """Return the results with machine, versions and date, as JSON-able values."""
        return {**conditions(), **self.table()}


def conditions() -> dict[str, Any]:
    """Return the conditions of a measurement, JSON-able: date, clock, machine and versions."""
    return {
        "date": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds"),
        "version": __version__,
        "clock": "CPU time of the thread",
        "machine": {
            "processor": _processor(),
            "cores": os.cpu_count(),
            "load_average": list(psutil.getloadavg()),
            "system": platform.platform(),
        },
        "versions": {
            "python": platform.python_version(),
            "llvmlite": llvmlite.__version__,
            "numpy": np.__version__,
        },
    }


def _processor() -> str:
    """Return the model name of the processor, from Linux if it reports one."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def off_axis(scene: Scene) -> tuple[Scene, float]:
    """Return the scene with all balls shifted if one starts at exactly 0, and the shift [rad]."""
    starts = start_angles(scene)
    if all(starts):
        return scene, 0.0
    raw: dict[str, Any] = scene.as_mapping()
    angles = [angle + _OFF_AXIS for angle in starts]
    raw["start"] = {**raw["start"], "ball_angles": angles}
    try:
        return check_scene(raw, scene.name), _OFF_AXIS
    except SceneError:
        return scene, 0.0  # a full oval race may have no room for the balls elsewhere


def variants(scene: Scene, leave_one_out: bool = False) -> list[Variant]:
    """Return variants of a scene: without effects, with each effect alone, and with all of them.

    With ``leave_one_out``, variants with all effects except one follow. All use the stepper of the
    unchanged scene. An effect that is invalid alone is combined with the fewest other effects of
    the scene that make it valid. Sensors are treated like effects.

    Raises
    ------
    SceneError
        The scene cannot run at its step.
    """
    stepper = choose_stepper(scene, system_of(scene)).stepper.name
    effects, sensors = tuple(scene.effects), tuple(scene.sensors)
    result = [Variant(BASE, _with(scene, (), (), stepper))]
    result += [_alone(scene, name, stepper) for name in effects]
    result += [Variant(f"sensor {name}", _with(scene, (), (name,), stepper)) for name in sensors]
    result.append(Variant(ALL, _with(scene, effects, sensors, stepper)))
    if leave_one_out:
        for name in effects:
            with contextlib.suppress(SceneError):  # another effect needs it
                variant = _with(scene, _without(effects, name), sensors, stepper)
                result.append(Variant(f"all but {name}", variant))
        for name in sensors:
            variant = _with(scene, effects, _without(sensors, name), stepper)
            result.append(Variant(f"all but sensor {name}", variant))
    return result


def _without(names: tuple[str, ...], name: str) -> tuple[str, ...]:
    """Return the names except one."""
    return tuple(other for other in names if other != name)


def _alone(scene: Scene, name: str, stepper: str) -> Variant:
    """Return the variant with one effect, and the fewest other effects that make it valid.

    Raises
    ------
    SceneError
        The effect is invalid with every combination of the others.
    """
    others = [other for other in scene.effects if other != name]
    for count in range(len(others) + 1):
        for added in combinations(others, count):
            try:
                return Variant(name, _with(scene, (*added, name), (), stepper), added)
            except SceneError:
                continue
    raise SceneError(
        f"effects.{name}: is refused alone and with every combination of the scene's other "
        "effects; remove it, or add the effect that it needs"
    )


def _with(scene: Scene, effects: Sequence[str], sensors: Sequence[str], stepper: str) -> Scene:
    """Return the scene with these effects and sensors only, and with a stepper.

    Raises
    ------
    SceneError
        The scene is invalid, or the stepper cannot take its step.
    """
    raw: dict[str, Any] = scene.as_mapping()
    for section, names in (("effects", effects), ("sensors", sensors)):
        raw[section] = {name: raw[section][name] for name in raw[section] if name in names}
    raw["solver"] = {**raw["solver"], "stepper": stepper}
    changed = check_scene(raw, scene.name)
    choose_stepper(changed, system_of(changed))
    return changed


class _Runner:
    """Variant with a warmed-up drive, ready to be timed.

    Parameters
    ----------
    variant
        Variant to be timed.
    steps
        Number of steps of a run.
    """

    def __init__(self, variant: Variant, steps: int) -> None:
        self.variant, self.steps = variant, steps
        self.failure, self.events = "", 0.0
        self.nanoseconds: list[float] = []
        begin = time.perf_counter()
        try:
            self.drive = Drive(variant.scene)
            self.drive.advance(1)
            self.first_seconds = time.perf_counter() - begin
            # Other kinds of segment have other kernels: run them all, so that they are compiled.
            self.drive.advance(steps - 1)
            self.events = 1000.0 * self.drive.events / steps
        except (DivergedError, SceneError) as error:
            self.first_seconds = time.perf_counter() - begin
            self.failure = str(error)

    def time_once(self) -> None:
        """Time one run from the start, without the drive's reset."""
        self.drive.reset()
        begin = time.thread_time_ns()
        self.drive.advance(self.steps)
        self.nanoseconds.append((time.thread_time_ns() - begin) / self.steps)


def effect_cost(
    scene: SceneLike,
    repeats: int = REPEATS,
    *,
    leave_one_out: bool = False,
    progress: Progress | None = None,
) -> EffectCost:
    """Measure the cost per step of each effect and sensor of a scene: ``ab-sim cost``.

    Parameters
    ----------
    scene : Scene, str or Path
        Scene to run, for at most 10,000 steps.
    repeats : int, default 15
        Rounds in which all variants are timed in turns.
    leave_one_out : bool, default False
        Also measure the scene's set of effects without each of them.
    progress : callable, optional
        Called with the current task, the number of finished parts and the total.

    Returns
    -------
    EffectCost
        ``rows``, one for each variant: ns per step, and events per 1000 steps.

    Raises
    ------
    SceneError
        An effect cannot run alone, nor with any combination of the scene's others.
    InputError
        ``repeats`` is below 1, or the scene cannot run without effects or with all of them.

    Notes
    -----
    A profile that is controlled during the run is replaced by its plan (``Scene.planned``). If a
    ball starts at an angle of 0, all start angles are shifted by ``_OFF_AXIS``. Time is the CPU
    time of the thread in ``Drive.advance``, after one run to warm up.

    Examples
    --------
    >>> import ab_sim
    >>> scene = ab_sim.load_scene("nsc-case-1", ["duration=0.05"])
    >>> [row.name for row in ab_sim.effect_cost(scene, repeats=1).rows][0]
    'no effects'
    """
    if repeats < 1:
        raise InputError(f"repeats = {repeats}: must be at least 1")
    tell = progress or (lambda what, done, total: None)
    scene = resolve_accuracy(as_scene(scene), tell=progress)[0].planned
    steps = min(_MOST_STEPS, max(1, math.ceil(scene.duration / scene.solver.step - 1e-9)))
    scene, turned = off_axis(scene)
    wanted = variants(scene, leave_one_out)
    runners = []
    for done, variant in enumerate(wanted):
        tell(f"compiling {variant.name}", done, len(wanted))
        runners.append(_Runner(variant, steps))
        if runners[-1].failure and variant.name in (BASE, ALL):
            raise InputError(
                f"{scene.name} with {variant.name}: {runners[-1].failure}; without it there is "
                "nothing to compare with"
            )
    running = [runner for runner in runners if not runner.failure]
    # Each round starts with another variant: a processor that slows down affects all alike.
    for turn in range(repeats):
        tell("measuring", turn, repeats)
        for offset in range(len(running)):
            running[(turn + offset) % len(running)].time_once()
    base = np.array(runners[0].nanoseconds)
    return EffectCost(
        scene.name,
        scene.balls.count,
        runners[0].drive.stepper.name,
        scene.solver.step,
        turned,
        steps,
        repeats,
        tuple(_row(runner, base) for runner in runners),
    )


def _row(runner: _Runner, base: np.ndarray) -> VariantCost:
    """Return the cost of a variant; ``base`` has the times of ``BASE`` [ns], shape (repeats,)."""
    times = np.array(runner.nanoseconds)
    return VariantCost(
        runner.variant.name,
        tuple(runner.variant.scene.effects),
        tuple(runner.variant.scene.sensors),
        runner.variant.added,
        Quartiles.of(times) if len(times) else None,
        Quartiles.of(times / base) if len(times) else None,
        runner.events,
        runner.first_seconds,
        runner.failure,
    )
