"""Run the study: first the errors of all methods, then their interleaved timings."""

import importlib.util
import math
import time
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache, partial

import numpy as np

from ab_sim.analysis.accuracy_cost.methods import (
    SCIPY,
    ByTolerance,
    FailedError,
    LegSolver,
    MeasuredMethod,
    OwnStepper,
    cvode_solvers,
)
from ab_sim.analysis.accuracy_cost.mujoco_peer import MuJoCo, mujoco_refusal
from ab_sim.analysis.accuracy_cost.problem import (
    LADDER,
    RightHandSide,
    SampleTimes,
    energy_balance_refusal,
    nanoseconds,
    sampling_of,
)
from ab_sim.analysis.accuracy_cost.reference import Reference, event_reference, smooth_reference
from ab_sim.analysis.accuracy_cost.results import (
    AccuracyCost,
    OmittedMethod,
    RunErrors,
    SettingCost,
)
from ab_sim.analysis.effect_cost import Quartiles
from ab_sim.base.errors import InputError, SceneError
from ab_sim.base.presentation import Progress
from ab_sim.drive.accuracy import resolve_accuracy
from ab_sim.drive.accuracy.trials import Deviation, Samples, deviation
from ab_sim.engine.integrate.choose import choose_stepper
from ab_sim.engine.integrate.registry import steppers
from ab_sim.model.dynamics.assemble import system_of
from ab_sim.model.dynamics.system import has_events
from ab_sim.scene.load import SceneLike, as_scene, with_solver
from ab_sim.scene.model import Scene

_TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-13)
"""Relative tolerances at which peers are measured."""
_FINER = (5e-5, 2e-5, 1e-5, 5e-6, 2e-6, 1e-6)
"""Shorter steps than requested [s], for a stepper that is unstable at the requested ones."""
_LEAST_STEPS = 3
"""Number of stable step lengths below which steps of ``_FINER`` are measured, too."""
_EXTRA = "not installed; pip install 'ab_sim[peers]'"
"""Text for a missing peer."""

Setting = tuple[str, Callable[[], MeasuredMethod]]
"""Name of a setting, and function that creates the method with that setting."""
Family = tuple[str, Sequence[Setting]]
"""Name of a method, and its settings from coarse to fine."""


def all_families(
    scene: Scene,
    sampling: SampleTimes,
    f: RightHandSide | None,
    with_energy_balance: bool,
    steps: Sequence[float],
    tolerances: Sequence[float],
) -> tuple[list[Family], list[OmittedMethod]]:
    """Return all methods for a scene, and those that cannot run it.

    Parameters
    ----------
    scene
        The scene.
    sampling
        Times at which runs are compared.
    f
        The scene as a right-hand side; None if it has events.
    with_energy_balance
        Whether the scene can keep an energy balance.
    steps
        Steps to try [s].
    tolerances
        Relative tolerances to try.
    """
    divides = [step for step in steps if sampling.per_period(step)]
    missing = [
        OmittedMethod(f"steps of {1e3 * step:g} ms",
                      f"do not divide {sampling.period:g} s, at which runs are compared")
        for step in steps
        if step not in divides
    ]  # fmt: skip
    families = [*_ours(scene, sampling, divides)]
    if f is None:
        missing += [OmittedMethod(name, _events_reason(scene)) for name in (*SCIPY, "CVODE")]
    else:
        tolerances = sorted(tolerances, reverse=True)
        families += _by_tolerance(f, with_energy_balance, tolerances, missing)
    families += _mujoco(scene, sampling, divides, missing)
    return families, missing


def _ours(scene: Scene, sampling: SampleTimes, steps: Sequence[float]) -> Iterator[Family]:
    """Yield every registered stepper with its settings: the steps [s], and the scene's own step.

    A stepper that is stable at fewer than ``_LEAST_STEPS`` of them also gets steps of ``_FINER``.
    """
    scene_steps = [scene.solver.step] if sampling.per_period(scene.solver.step) else []
    ladder = sorted({*steps, *scene_steps}, reverse=True)
    for name in steppers():
        settings = [
            (f"{1e3 * step:g} ms", partial(OwnStepper, scene, sampling, name, step))
            for step in ladder
        ]
        longest = _longest(scene, name, ladder[-1] if ladder else _FINER[-1])
        allowed = sum(step <= longest for step in ladder)
        finer = [s for s in _FINER if s <= longest and sampling.per_period(s)]
        if allowed < _LEAST_STEPS:
            settings += [
                (f"{1e3 * step:g} ms", partial(OwnStepper, scene, sampling, name, step))
                for step in finer[: _LEAST_STEPS - allowed]
            ]
        yield name, settings


def _longest(scene: Scene, stepper: str, step: float) -> float:
    """Return the longest step that a stepper may take in a scene [s]; 0 if it refuses all.

    Parameters
    ----------
    scene
        Scene to run.
    stepper
        Name of the stepper.
    step
        Step that is tried first [s]; if the stepper refuses it, those of ``_FINER`` follow.
    """
    for shorter in (step, *_FINER):
        candidate = with_solver(scene, stepper, shorter)
        try:
            return choose_stepper(candidate, system_of(candidate)).longest
        except SceneError:
            continue
    return 0.0


def _by_tolerance(
    f: RightHandSide,
    with_energy_balance: bool,
    tolerances: Sequence[float],
    missing: list[OmittedMethod],
) -> list[Family]:
    """Return SciPy's integrators and CVODE with their tolerances; see ``all_families``.

    CVODE is appended to ``missing`` if it is not installed.
    """
    solvers: dict[str, LegSolver] = dict(SCIPY)
    try:
        solvers.update(cvode_solvers())
    except ImportError:
        missing.append(OmittedMethod("CVODE", f"scikit-sundae is {_EXTRA}"))
    # Compiled once, when the first method needs it.
    f_balance = (
        lru_cache(partial(RightHandSide, f.scene, f.sampling, True))
        if with_energy_balance
        else None
    )
    return [
        (
            name,
            [
                (f"rtol {rtol:g}", partial(ByTolerance, f, f_balance, name, solver, rtol))
                for rtol in tolerances
            ],
        )
        for name, solver in solvers.items()
    ]


def _mujoco(
    scene: Scene, sampling: SampleTimes, steps: Sequence[float], missing: list[OmittedMethod]
) -> list[Family]:
    """Return MuJoCo with its steps [s]; append it to ``missing`` if it cannot run the scene."""
    refusal = mujoco_refusal(scene)
    if not refusal and importlib.util.find_spec("mujoco") is None:
        refusal = f"MuJoCo is {_EXTRA}"
    if refusal:
        missing.append(OmittedMethod(MuJoCo.name, refusal))
        return []
    ladder = sorted(steps, reverse=True)
    settings = [(f"{1e3 * step:g} ms", partial(MuJoCo, scene, sampling, step)) for step in ladder]
    return [(MuJoCo.name, settings)]


def _events_reason(scene: Scene) -> str:
    """Return the reason to omit methods that cannot locate the events of a scene."""
    names = [name for name, e in scene.effects.items() if has_events((e,))]
    return (
        f"{', '.join(names)}: forces switch at events, which this study does not let it locate; "
        "across kinks of the right-hand side every method falls to first order"
    )


REPEATS = 9
"""Default number of rounds in which all settings are timed."""

NEAR = 3.0
"""Ratio of error to the reference's uncertainty below which no finer settings are run."""
_LONG_RUN = 3.0
"""CPU time of a run beyond which finer settings of the method are left out [s]."""
_TIME_FOR_ONE = 6.0
"""CPU time for the repeats of one setting [s]."""


class _Candidate:
    """Method at one setting, with its measurements.

    Parameters
    ----------
    method
        Method at the setting.
    errors
        Errors of its untimed run.
    seconds
        CPU time of that run [s].
    repeats
        Requested number of timed runs; long runs are repeated less.
    """

    def __init__(
        self, method: MeasuredMethod, errors: RunErrors, seconds: float, repeats: int
    ) -> None:
        self.method, self.errors = method, errors
        self.repeats = max(1, min(repeats, math.ceil(_TIME_FOR_ONE / max(seconds, 1e-9))))
        self.seconds: list[float] = []

    def time_once(self) -> None:
        """Run once from the start, and add the CPU time [s]."""
        self.method.prepare()
        begin = time.thread_time()
        self.method.run()
        self.seconds.append(time.thread_time() - begin)


def accuracy_cost(
    scene: SceneLike,
    repeats: int = REPEATS,
    *,
    steps: Sequence[float] = LADDER,
    tolerances: Sequence[float] = _TOLERANCES,
    progress: Progress | None = None,
) -> AccuracyCost:
    """Measure error and CPU time of every method at every setting: ``ab-sim accuracy``.

    This takes minutes for a scene of seconds.

    Parameters
    ----------
    scene : Scene, str or Path
        Scene to run.
    repeats : int, default 9
        Rounds in which all settings are timed in turns.
    steps : sequence of float, optional
        Steps to try [s], whole nanoseconds.
    tolerances : sequence of float, optional
        Relative tolerances to try for peers that choose their steps; empty: such peers are left
        out.
    progress : callable, optional
        Called with the current task, the number of finished parts and the total.

    Returns
    -------
    AccuracyCost
        ``rows``: errors of ball angle [rad] and whirl [e], and CPU seconds per simulated second;
        ``cheapest(error)``.

    Raises
    ------
    SceneError
        The scene cannot run.
    InputError
        ``repeats`` is below 1, the scene is too short, or no reference can be made.

    Notes
    -----
    Each setting is run once, untimed, for its errors, from coarse to fine. Finer settings of a
    method are left out once its error is as small as the reference can resolve, or once a run takes
    too long. Then all settings are timed in turns, in CPU time of the thread, without compiling. A
    profile that is controlled during the run is replaced by its plan (``Scene.planned``).

    Examples
    --------
    >>> import ab_sim
    >>> scene = ab_sim.load_scene("nsc-case-1", ["duration=0.1"])
    >>> cost = ab_sim.accuracy_cost(scene, repeats=1, steps=[1e-3], tolerances=[1e-8])
    >>> cost.cheapest(1e-4, peer=False) in cost.rows
    True
    """
    if repeats < 1:
        raise InputError(f"repeats = {repeats}: must be at least 1")
    tell = progress or (lambda what, done, total: None)
    # A requested accuracy is resolved to a step first; the study measures that step too.
    resolved, _ = resolve_accuracy(as_scene(scene), tell=progress)
    scene = resolved.planned
    choice = choose_stepper(scene, system_of(scene))
    sampling = sampling_of(scene)
    tell("reference", 0, 1)
    smooth = not has_events(system_of(scene).effects)
    f = RightHandSide(scene, sampling) if smooth else None
    reference = event_reference(scene, sampling) if f is None else smooth_reference(f)
    no_energy_balance = energy_balance_refusal(scene)
    study = _Study(scene, sampling, reference, repeats, not no_energy_balance)
    families, missing = all_families(scene, sampling, f, not no_energy_balance, steps, tolerances)
    study.omitted += missing
    for done, (name, settings) in enumerate(families):
        tell(f"errors of {name}", done, len(families))
        study.family(name, settings)
    rows = study.timed(tell)
    notes = [f"no energy balance: {no_energy_balance}"] if no_energy_balance else []
    if scene.profile != resolved.profile:
        notes.append("the profile runs as planned, without its decisions during the run")
    if nanoseconds(sampling.end) != nanoseconds(scene.duration):
        notes.append(
            f"compared up to {sampling.end:g} s of {scene.duration:g} s: the last whole multiple "
            f"of {sampling.period:g} s"
        )
    return AccuracyCost(
        scene.name,
        tuple(scene.effects),
        scene.balls.count,
        sampling.end,
        sampling.period,
        sampling.finest.period,
        *scene.whirl_unit,
        f"{choice.stepper.name} at {scene.solver.step:g} s",
        reference.text,
        reference.shares,
        reference.uncertainty,
        repeats,
        tuple(rows),
        tuple(study.omitted),
        tuple(notes),
    )


class _Study:
    """Study in progress: candidates with their errors, and rows and reasons of the others.

    Parameters
    ----------
    scene
        Scene to run.
    sampling
        Times at which runs are compared.
    reference
        Reference solution.
    repeats
        Requested number of timed runs per setting.
    with_energy_balance
        Whether the scene can keep an energy balance.
    """

    def __init__(
        self,
        scene: Scene,
        sampling: SampleTimes,
        reference: Reference,
        repeats: int,
        with_energy_balance: bool,
    ) -> None:
        self.scene, self.sampling, self.reference = scene, sampling, reference
        self.repeats, self.with_energy_balance = repeats, with_energy_balance
        self.candidates: list[_Candidate] = []
        self.failed: list[SettingCost] = []
        self.omitted: list[OmittedMethod] = []

    def family(self, name: str, settings: Sequence[Setting]) -> None:
        """Run a method's settings, from coarse to fine, for their errors."""
        refused: dict[str, list[str]] = {}
        for index, (setting, make) in enumerate(settings):
            try:
                method = make()
            except SceneError as error:
                refused.setdefault(_reason(error), []).append(setting)
                continue
            reason = self._run(method)
            if reason:
                finer = [what for what, _ in settings[index + 1 :]]
                if finer:
                    what = f"{name} at {', '.join(finer)}"
                    self.omitted.append(OmittedMethod(what, f"at {setting} {reason}"))
                break
        for reason, which in refused.items():
            self.omitted.append(
                OmittedMethod(f"{name} at {', '.join(which)}", f"refused: {reason}")
            )

    def _run(self, method: MeasuredMethod) -> str:
        """Measure one setting's errors; return the reason to omit finer ones, or empty text."""
        try:
            method.prepare()
            begin = time.thread_time()
            samples = method.samples(method.run())
            seconds = time.thread_time() - begin
        except FailedError as error:
            row = SettingCost(
                method.name, method.peer, method.step, method.tolerance,
                None, None, 0, None, str(error),
            )  # fmt: skip
            self.failed.append(row)
            return ""
        deviation = self._deviation(method.name, samples)
        energy = method.energy_error() if self.with_energy_balance else None
        errors = RunErrors.of(deviation, self.reference.uncertainty, energy)
        self.candidates.append(_Candidate(method, errors, seconds, self.repeats))
        limit = self.reference.uncertainty
        if deviation.angle <= NEAR * limit.angle and deviation.whirl <= NEAR * limit.whirl:
            return "its error is already as small as the reference can resolve"
        if seconds > _LONG_RUN:
            return f"a run already takes {seconds:.1f} s"
        return ""

    def _deviation(self, name: str, samples: Samples) -> Deviation:
        """Return the deviation of a method's samples from the reference that judges it."""
        return deviation(samples, self.reference.samples_for(name), self.scene.whirl_unit[0])

    def timed(self, tell: Progress) -> list[SettingCost]:
        """Time all settings in turns; return their rows and those of failed settings."""
        for turn in range(self.repeats):
            tell("measuring", turn, self.repeats)
            count = len(self.candidates)
            # Each round starts with another setting: a slow phase of the machine affects all alike.
            for offset in range(count):
                candidate = self.candidates[(turn + offset) % count]
                if len(candidate.seconds) < candidate.repeats:
                    candidate.time_once()
        return [self._row(candidate) for candidate in self.candidates] + self.failed

    def _row(self, candidate: _Candidate) -> SettingCost:
        """Return the cost and errors of a candidate after all its timed runs."""
        method, simulated = candidate.method, self.sampling.end
        evaluations = method.evaluations
        return SettingCost(
            method.name,
            method.peer,
            method.step,
            method.tolerance,
            candidate.errors,
            Quartiles.of(np.array(candidate.seconds) / simulated),
            len(candidate.seconds),
            None if evaluations is None else evaluations / simulated,
        )


def _reason(error: SceneError) -> str:
    """Return why a step was refused, without the step's length: equal reasons have equal texts."""
    return str(error).split(" s: ", 1)[-1].split("; or leave")[0]
