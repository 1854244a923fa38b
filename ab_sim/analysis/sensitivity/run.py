"""A run with its derivatives by numbers of the scene."""

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ab_sim.accuracy import resolve_accuracy
from ab_sim.analysis.sensitivity.changes import SceneChange, changes_by
from ab_sim.analysis.sensitivity.keys import NoDerivative, RealKey, real_key
from ab_sim.analysis.sensitivity.of_merits import MeritSensitivities, of_merits
from ab_sim.analysis.sensitivity.of_readings import of_readings
from ab_sim.analysis.sensitivity.plan import plan_of
from ab_sim.analysis.sensitivity.tangents import RunWithTangents
from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory, check_room, column_of
from ab_sim.drive.units import unit_of
from ab_sim.dynamics.assemble import system_of
from ab_sim.dynamics.layout import layout_of
from ab_sim.errors import InputError, exact, nearest
from ab_sim.integrate.choose import choose_stepper
from ab_sim.integrate.explicit import Tableau
from ab_sim.presentation import Column, Columns, Presented, ends
from ab_sim.scene.model import Scene
from ab_sim.spindle import SpeedSchedule
from ab_sim.spindle.step_ranges import StepGrid
from ab_sim.stepping.fixed_step import ANGLE
from ab_sim.stepping.tangent_events import GRAZED, TOGETHER, UNRESOLVED
from ab_sim.stepping.tangent_functions import OVERLAP

EXPLICIT = "rk8"
"""What runs scenes whose stepper is no explicit Runge-Kutta method."""
AT_ONCE = 1000
"""Steps between two looks at Ctrl-C."""


@dataclass(frozen=True, repr=False)
class Sensitivities(Presented):
    """Derivatives of a run's channels by numbers of its scene; see ``ab_sim.sensitivities``."""

    _rows = 0

    scene: Scene
    """As it was run."""
    stepper: str
    """That ran it."""
    trajectory: Trajectory
    """The run: every integration step, the start included."""
    keys: tuple[str, ...]
    """Of the scene."""
    values: np.ndarray
    """Of the keys, shape (keys,)."""
    key_units: tuple[str, ...]
    """SI."""
    channels: tuple[str, ...]
    """Of the trajectory."""
    steps: np.ndarray
    """Numbers of the samples, shape (samples,)."""
    derivatives: np.ndarray
    """d channel / d key at each sample, SI, shape (channels, keys, samples)."""

    @property
    def times(self) -> np.ndarray:
        """Of the samples [s]."""
        return np.asarray(self.trajectory["time"][self.steps])

    def of(self, channel: str, key: str) -> np.ndarray:
        """d channel / d key, shape (samples,).

        Raises:
            InputError: there is no such channel, or no such key; names those there are.
        """
        if channel not in self.channels:
            raise _not_among("channel", channel, self.channels)
        if key not in self.keys:
            raise _not_among("key", key, self.keys)
        found: np.ndarray = self.derivatives[self.channels.index(channel), self.keys.index(key)]
        return found

    def of_merits(self, names: Sequence[str]) -> MeritSensitivities:
        """Derivatives of what the run is judged by.

        Parameters
        ----------
        names : sequence of str
            Of merits that are numbers: `ab-sim merits` lists them.

        Returns
        -------
        MeritSensitivities
            ``derivatives``, shape (merits, keys), and ``elasticities``, percent per percent.

        Raises
        ------
        InputError
            There is no such merit, it has no value in this run, or jumps from sample to sample; or
            not all channels and steps have been asked for.
        NoDerivative
            It has a jump or a kink just here.
        """
        every = _moving(self.scene, self.trajectory.channels)
        if list(self.channels) != every or len(self.steps) != len(self.trajectory):
            raise InputError(
                "merits need derivatives of all channels at all steps: leave out channels and times"
            )
        each = zip(self.keys, self.values.tolist(), self.key_units, strict=True)
        keys = [RealKey(*key) for key in each]
        return of_merits(self.scene, self.trajectory, keys, self.derivatives, names)

    def _facts(self) -> dict[str, str]:
        return {
            "scene": self.scene.name,
            "keys": ", ".join(self.keys),
            "channels": str(len(self.channels)),
            "samples": str(len(self.steps)),
            "time": ends(self.times[0], self.times[-1], "s"),
        }

    def _columns(self) -> Columns:
        found = {"time": Column("s", self.times)}
        for i, channel in enumerate(self.channels):
            for k, key in enumerate(self.keys):
                unit = f"({unit_of(channel)})/({self.key_units[k]})"
                found[f"{channel} by {key}"] = Column(unit, self.derivatives[i, k])
        return found


def sensitivities(
    scene: Scene,
    keys: Sequence[str],
    channels: Sequence[str] | None = None,
    times: Sequence[float] | np.ndarray | None = None,
    progress: Callable[[float, float], None] | None = None,
) -> Sensitivities:
    """Run a scene, with its derivatives; see ``ab_sim.sensitivities``."""
    if isinstance(keys, str) or not keys:
        raise InputError(f"keys = {keys!r}: must be a list of the scene's keys, at least one")
    real = [real_key(scene, key) for key in keys]
    SpeedSchedule.of_scene(scene)  # refuses what measurements decide
    scene = with_explicit_stepper(scene)
    drive = Drive(scene)
    moving = _moving(scene, drive.channels)
    named = _named(drive.channels[ANGLE:], moving, channels)
    wanted, steps = _wanted(drive, times)
    # A sensor's low-pass remembers all that it has felt.
    reads = not set(named) <= set(moving)
    samples = steps + 1 if reads or times is None else len(wanted)
    try:
        check_room(steps + samples * len(keys), 1, drive.channels)
    except ValueError:
        raise InputError(
            f"{steps} steps are too many to keep with their derivatives by {len(keys)} keys: end "
            "the run before (duration, times), or ask for fewer keys or times"
        ) from None
    looked_at = range(steps + 1) if reads else wanted
    run, derivatives = _integrated(scene, drive, real, looked_at, progress)
    if reads:
        readings = of_readings(scene, run, real, derivatives)
        derivatives = np.concatenate([derivatives, readings])[:, :, wanted]
    rows = [column_of(name, drive.channels) - ANGLE for name in named]
    return Sensitivities(
        scene,
        drive.stepper.name,
        run,
        tuple(keys),
        np.array([each.value for each in real]),
        tuple(each.unit for each in real),
        tuple(named),
        np.array(wanted),
        derivatives[rows],
    )


def _integrated(
    scene: Scene,
    drive: Drive,
    keys: Sequence[RealKey],
    wanted: Sequence[int],
    progress: Callable[[float, float], None] | None,
) -> tuple[Trajectory, np.ndarray]:
    """The run up to the last of the wanted samples, and the derivatives of its channels there.

    Returns:
        Every step; and shape (channels from ANGLE on but for sensors', keys, wanted).
    """
    own = _tangents(scene, drive, keys, wanted)
    taken, steps = [drive.present()], wanted[-1]
    # Of no steps, one is taken to see to the branches where it begins.
    for first in range(0, max(steps, 1), AT_ONCE):
        count = min(AT_ONCE, steps - first)
        taken.append(drive.advance(count))
        own.advance(first, max(count, 1))
        if own.trouble[0]:
            raise _refused(scene, own.trouble, [key.key for key in keys])
        if progress is not None:
            progress(drive.time, steps * drive.step)
    return Trajectory.join(taken), own.row_changes.transpose(1, 2, 0)


def with_explicit_stepper(scene: Scene) -> Scene:
    """The scene as it is run: by its own stepper if that is explicit Runge-Kutta, else by rk8.

    An accuracy that it asks for is resolved first.
    """
    scene, _ = resolve_accuracy(scene)
    choice = choose_stepper(scene, system_of(scene))
    if isinstance(choice.stepper.weights, Tableau):
        return scene
    solver = scene.solver.model_copy(update={"stepper": EXPLICIT, "parameters": {}})
    return scene.model_copy(update={"solver": solver})


def _tangents(
    scene: Scene, drive: Drive, keys: Sequence[RealKey], wanted: Sequence[int]
) -> RunWithTangents:
    tableau = drive.stepper.weights
    assert isinstance(tableau, Tableau)
    system, layout = drive.system, layout_of(drive.system)
    changes: list[SceneChange] = [changes_by(scene, key, layout) for key in keys]
    profile = SpeedSchedule.of_scene(scene)
    count = len(profile.segments)
    by_segment = [np.array([change.segments[k] for change in changes]).T for k in range(count)]
    plan = plan_of(profile, StepGrid(drive.step, drive.choice.cycle), by_segment)
    return RunWithTangents(scene, system, tableau, changes, plan, wanted)


def _named(
    known: Sequence[str], moving: Sequence[str], channels: Sequence[str] | None
) -> list[str]:
    """Names, checked; default all but sensors'."""
    if channels is None:
        return list(moving)
    for name in channels:
        if name not in known:
            raise _not_among("channel", name, known)
    return list(channels)


def _moving(scene: Scene, channels: Sequence[str]) -> list[str]:
    """Channels from the spindle's angle on but for sensors', which are the last ones."""
    axes = 2 if scene.deck is None else 3
    return list(channels[ANGLE : len(channels) - axes * len(scene.pickups)])


def _wanted(drive: Drive, times: Sequence[float] | np.ndarray | None) -> tuple[Sequence[int], int]:
    """Numbers of the samples that are wanted, and how many steps there are to be."""
    if times is None:
        steps = math.ceil(drive.scene.duration / drive.step - 1e-9)
        return range(steps + 1), steps
    found = []
    for time in times:
        number = round(time / drive.step) if abs(time) <= sys.float_info.max else -1
        if number < 0 or abs(number * drive.step - time) > 1e-6 * drive.step:
            raise InputError(
                f"times: {exact(time)} s: must be a whole number of steps of {drive.step:g} s, "
                "from 0 on"
            )
        found.append(number)
    if not found or any(b <= a for a, b in zip(found, found[1:], strict=False)):
        raise InputError("times: must rise, and be at least one")
    return found, found[-1]


def _refused(scene: Scene, trouble: tuple[int, int, int, int], keys: Sequence[str]) -> NoDerivative:
    kind, which, steps, column = trouble
    when = f"between {steps * scene.solver.step:g} and {(steps + 1) * scene.solver.step:g} s"
    if kind in (TOGETHER, OVERLAP):
        key = keys[column]
        said = {
            TOGETHER: f"ball {which} comes to rest together with another one {when}; a change of "
            f"{key} alone would take them apart, and what follows has no derivative by it: leave "
            "it out, or start the balls apart (start.ball_angles)",
            OVERLAP: f"balls touch at the start, and a change of {key} alone would part them, or "
            "make them overlap: leave it out, or start the balls apart (start.ball_angles)",
        }[kind]
        return NoDerivative(f"{scene.name}: {said}", key)
    said = {
        GRAZED: f"an event is only just reached {when}, and with a little change would not be: "
        "there is no derivative; change the scene a little, or end the run before (duration)",
        UNRESOLVED: f"too many events to locate {when}: there is no derivative; take a shorter "
        "solver.step",
    }[kind]
    return NoDerivative(f"{scene.name}: {said}", None)


def _not_among(what: str, name: str, known: Sequence[str]) -> InputError:
    return InputError(
        f"{what} {name!r}: there is none{nearest(name, known)}; there are: {', '.join(known)}"
    )
