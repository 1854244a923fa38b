"""Identification from recordings to a verdict."""

import math
from collections.abc import Mapping as Dictionary
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ab_sim.base.errors import InputError, Interrupted
from ab_sim.base.presentation import Progress
from ab_sim.base.workers import WorkerLost, Workers
from ab_sim.drive.accuracy import resolve_accuracy
from ab_sim.identification.changes import Departure, changes_in
from ab_sim.identification.intervals import HELD, Intervals, intervals_of
from ab_sim.identification.intervals import OPEN as NOT_KNOWN
from ab_sim.identification.knowledge import Knowledge, knowledge_before, knowledge_of
from ab_sim.identification.measured import Measured
from ab_sim.identification.missing import tried_effects, tried_scales
from ab_sim.identification.parameters import ANGLES, fitted_parameters
from ab_sim.identification.problem import Problem
from ab_sim.identification.proposals import proposals_for
from ab_sim.identification.residuals import NOISELESS, noises_of, total_z, whiteness_over
from ab_sim.identification.result import (
    INTERRUPTED,
    HeldOut,
    Identification,
    Proposal,
    RecordingFit,
    TriedEffect,
)
from ab_sim.identification.stages import DRAWS, LAST_STEPS, SearchSettings, StagedFit, minimise
from ab_sim.identification.verdict import explained_by, misfits_of, verdict_of
from ab_sim.model.equations.neighbours import equal_pairs
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene

NEAR = 0.7
"""Top speed, relative to the critical speed, below which a run hardly determines the damping."""
_UNEXPLAINED = 0.5
"""Relative r.m.s. of residuals above which a fit explains nothing."""
_FAR_OFF = 300.0
"""Ratio of measured to simulated amplitude that indicates a wrong unit."""

_EXCHANGED = "equal balls cannot be told apart: their start angles may be exchanged"
"""Note on fitted start angles."""


class IdentificationSettings(NamedTuple):
    """Settings of an identification."""

    fit: tuple[str, ...]
    """Keys of the scene to be fitted."""
    bounds: Dictionary[str, tuple[float, float]] = {}
    """Bounds of some keys [SI]; default: a factor of 10 around the scene's value."""
    seed: int = 0
    """Seed of the random starts."""
    hold_open: bool = True
    """True to fix parameters that the recordings do not determine."""
    propose: bool = True
    """True to propose the next recording."""


def run_identification(
    scene: Scene,
    recordings: Sequence[Measured],
    settings: IdentificationSettings,
    held_out: Sequence[Measured] = (),
    tell: Progress = lambda *_: None,
    workers: int = 1,
) -> Identification:
    """Fit a scene to recordings, and assess the fit.

    Parameters
    ----------
    scene
        Scene with the start values.
    recordings
        Recordings with or without balls.
    settings
        Settings of the identification.
    held_out
        Recordings for validation only.
    tell
        Called with the current task, the number of finished tasks and the total. If it raises
        ``Interrupted``, the best fit so far is returned, marked as such.
    workers
        Number of processes for long searches.

    Raises
    ------
    InputError
        The identification is impossible; the message states the reason and the remedy.
    SceneError
        The scene cannot be run under the recorded conditions.
    WorkerLost
        A worker process was terminated.
    """
    scene, _ = resolve_accuracy(scene)
    if not recordings:
        raise InputError("no recordings: give one or several")
    work = _Work(scene, recordings, settings, held_out, tell)
    with Workers(workers) as shared:
        try:
            return work.run(SearchSettings(settings.seed, tell, shared))
        except WorkerLost as lost:
            raise WorkerLost(
                "a worker process of the search was ended by a signal or by lack of memory; run it "
                "again, with fewer --workers if memory is short"
            ) from lost


class _Work:
    """Single identification, from the problem to the result."""

    def __init__(
        self, scene: Scene, recordings: Sequence[Measured], settings: IdentificationSettings,
        held_out: Sequence[Measured], tell: Progress,
    ) -> None:  # fmt: skip
        self._scene, self._settings, self._tell = scene, settings, tell
        self._recordings, self._held_out = recordings, held_out
        common = fitted_parameters(scene, settings.fit, settings.bounds)
        self._problem = Problem(scene, common, recordings, noises_of(recordings))
        self._check_sizes()

    def run(self, search: SearchSettings) -> Identification:
        """Run the complete identification."""
        problem, settings = self._problem, self._settings
        knowledge = knowledge_before(problem, settings.seed, self._tell)
        held = list(knowledge.held) if settings.hold_open else []
        staged = StagedFit(problem, held, search)
        interrupted = False
        values, open_after = staged.best, Knowledge((), (), (), ())
        free = [j for j in range(len(problem.parameters)) if j not in held]
        try:
            values = _within_a_turn(problem, staged.run().values)
            _check_doubts(problem, values)
            # The noise estimated from spectra is rough. The residuals of the first fit give better
            # weights of the recordings for the last fit, and its residuals those of the intervals.
            problem = problem.with_noise(self._spreads(problem, values))
            values = minimise(problem, values, free, LAST_STEPS, True, self._last).values
            problem = problem.with_noise(self._spreads(problem, values))
            if settings.hold_open:
                open_after = knowledge_of(problem, values, held)
                held = sorted({*held, *open_after.held})
            free = [j for j in free if j not in held]
            intervals = intervals_of(problem, values, free, self._tell)
        except (Interrupted, KeyboardInterrupt):
            interrupted = True
            values = _within_a_turn(problem, staged.best)
            problem = problem.with_noise(self._spreads(problem, values))
            intervals = intervals_of(problem, values, free, lambda *_: None, profiles=False)
        intervals = _marked(intervals, problem, held)
        comparisons = [
            RecordingFit(measured, simulated, False)
            for k, measured in enumerate(problem.recordings)
            if (simulated := problem.simulated(k, values)) is not None
        ]
        whiteness = whiteness_over(problem, values)
        misfits = misfits_of(problem, values, whiteness)
        tried: tuple[TriedEffect, ...] = ()
        changes: tuple[Departure, ...] = ()
        outside: HeldOut | None = None
        proposals: tuple[Proposal, ...] = ()
        try:
            if not interrupted:
                white = [result.white for result in whiteness]
                if not all(white):
                    tried = tried_scales(problem, values, white, held, search)
                    if not explained_by(tried):
                        tried = tried_effects(problem, values, free, white, self._tell)
                    # A wrong scale of all recordings contains no information about a change of the
                    # drive.
                    if not explained_by(tried) and any(misfit.factor == 1.0 for misfit in misfits):
                        changes = changes_in(problem, white, held, search)
                if self._held_out:
                    outside, more = _validated(problem, values, self._held_out, search)
                    comparisons += more
                unbounded = [
                    estimate.name
                    for estimate in intervals.estimates
                    if not estimate.bounded and not estimate.per_recording
                ]
                if settings.propose:
                    proposals = proposals_for(problem, values, free, unbounded, self._tell)
        except (Interrupted, KeyboardInterrupt):
            interrupted = True
        opened = dict.fromkeys((*knowledge.open, *open_after.open))
        fitted, notes = self._fitted_scene(values)
        notes += [
            f"{name}: searches from {DRAWS} draws of starts ended in different minima: the best "
            "one may be wrong; start from a scene closer to the drive, or try another --seed"
            for name in staged.disagreements
        ]
        notes += [
            f"{measured.name}: {note}" for measured in self._recordings for note in measured.notes
        ]
        notes += [
            recording.doubt
            for recording, white in zip(problem.recordings, whiteness, strict=True)
            if recording.doubt and not white.white
        ]
        identification = Identification(
            fitted, self._scene, "", (), intervals, knowledge._replace(open=tuple(opened)),
            whiteness, tuple(comparisons), tried, outside, proposals, tuple(notes), problem.runs,
            settings.seed,
        )  # fmt: skip
        verdict, reasons = verdict_of(identification, misfits, changes, settings.fit)
        if interrupted:
            verdict = INTERRUPTED
            reasons.insert(0, "interrupted: these are the best values so far, not those of a fit")
        return replace(identification, verdict=verdict, reasons=tuple(reasons))

    def _fitted_scene(self, values: np.ndarray) -> tuple[Scene, list[str]]:
        """Return the fitted scene, which starts like the first recording with balls, and notes."""
        problem, notes = self._problem, []
        changes = {**problem.scene_values(values), "name": f"{self._scene.name}, fitted"}
        for k, measured in enumerate(problem.recordings):
            if measured.with_balls:
                start = problem.scene_values(values, k).items()
                changes |= {key: value for key, value in start if key.startswith(ANGLES)}
                notes.append(f"the fitted scene's balls start where those of {measured.name} did")
                if equal_pairs(self._scene):
                    notes.append(_EXCHANGED)
                break
        fitted = changed_scene(self._scene, changes, "the fitted scene")
        critical = fitted.critical_speed or 0.0
        notes += [
            f"{measured.name}: never comes near the critical speed, {critical:.3g} rad/s: its top "
            f"speed is {top:.3g} rad/s; damping shows near it: run faster"
            for measured in problem.recordings
            if (top := measured.schedule.top_speed) < NEAR * critical
        ]
        return fitted, notes

    def _check_sizes(self) -> None:
        """Refuse signals whose magnitude is far from the scene's: their unit is wrong."""
        for k, measured in enumerate(self._recordings):
            simulated = self._problem.simulated(k, self._problem.start)
            if simulated is None:
                continue
            size = float(np.sqrt(np.mean((simulated - simulated.mean(axis=0)) ** 2)))
            ratio = measured.rms / size if size > 0.0 else 1.0
            if not 1.0 / _FAR_OFF < ratio < _FAR_OFF:
                raise InputError(
                    f"{measured.name}: its signals' r.m.s. is {measured.rms:.3g} {measured.unit}, "
                    f"{ratio:.2g} times what the scene {self._scene.name} gives; is their unit "
                    "right? if so, start from a scene closer to the drive"
                )

    def _last(self, *_: object) -> None:
        self._tell("all recordings, final fit", 0, 1)

    def _spreads(self, problem: Problem, values: np.ndarray) -> list[float]:
        """Return a robust standard deviation of each recording's residuals [m or m/s^2]."""
        parts = []
        for k, measured in enumerate(problem.recordings):
            residuals = problem.whitened_residuals(k, values)
            # Outliers hardly change the median of the absolute residuals. For normal residuals it
            # is 0.6745 standard deviations.
            spread = float(np.nanmedian(np.abs(residuals))) / 0.6745
            rms = float(np.sqrt(np.nanmean(residuals**2)))
            parts.append(max(min(rms, 1.5 * spread), NOISELESS * measured.rms))
        return parts


def _check_doubts(problem: Problem, values: np.ndarray) -> None:
    """Refuse a recording that the checks doubted if the fit does not explain it, either.

    Raises
    ------
    InputError
        The residuals are large; the message is that of the recording's check.
    """
    for k, measured in enumerate(problem.recordings):
        if measured.doubt:
            simulated = problem.simulated(k, values)
            residuals = measured.signals if simulated is None else measured.signals - simulated
            if float(np.sqrt(np.nanmean(residuals**2))) > _UNEXPLAINED * measured.rms:
                raise InputError(measured.doubt)


def _within_a_turn(problem: Problem, values: np.ndarray) -> np.ndarray:
    """Return values with the recordings' angles reduced to -pi to pi."""
    turned = values.copy()
    for j, parameter in enumerate(problem.parameters):
        if parameter.is_own_angle:
            turned[j] = math.remainder(float(values[j]), 2.0 * math.pi)
    return turned


def _marked(intervals: Intervals, problem: Problem, held: Sequence[int]) -> Intervals:
    """Return intervals with the origin ``OPEN`` for parameters fixed as unidentifiable."""
    names = {problem.parameters[j].name for j in held}
    estimates = tuple(
        estimate._replace(how=NOT_KNOWN)
        if estimate.how == HELD and estimate.name in names
        else estimate
        for estimate in intervals.estimates
    )
    return intervals._replace(estimates=estimates)


def _validated(
    problem: Problem, values: np.ndarray, recordings: Sequence[Measured], search: SearchSettings
) -> tuple[HeldOut, list[RecordingFit]]:
    """Evaluate a fit on other recordings.

    Only the parameters of each recording are fitted: once with the common parameters of the
    original scene, and once with the fitted ones in ``values``.

    Returns
    -------
    tuple[HeldOut, list[RecordingFit]]
        Quality of the prediction, and the recordings that could be simulated with fitted values.
    """
    count = len(problem.common)
    noise = noises_of(recordings)
    shares, comparisons = [], []
    for common in (problem.start[:count], values[:count]):
        changed = [
            parameter._replace(start=float(value))
            for parameter, value in zip(problem.common, common, strict=True)
        ]
        other = Problem(problem.scene, changed, recordings, noise)
        fit = StagedFit(other, range(count), search).run()
        simulated = [other.simulated(k, fit.values) for k in range(len(recordings))]
        comparisons = [
            RecordingFit(measured, signals, True)
            for measured, signals in zip(recordings, simulated, strict=True)
            if signals is not None
        ]
        problem.runs += other.runs
        shares.append(_share(comparisons) if len(comparisons) == len(simulated) else np.inf)
    judged = whiteness_over(other, fit.values)
    return HeldOut(shares[0], shares[1], total_z(judged)), comparisons


def _share(comparisons: Sequence[RecordingFit]) -> float:
    """Return the r.m.s. of residuals relative to that of the signals, over all recordings."""
    parts = [
        np.nanmean(comparison.residuals**2) / comparison.measured.rms**2
        for comparison in comparisons
    ]
    return float(np.sqrt(np.mean(parts)))
