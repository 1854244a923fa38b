"""Result of an identification."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ab_sim.base.presentation import Column, Columns, Presented, finite
from ab_sim.base.version import __version__
from ab_sim.base.yaml_files import yaml_text
from ab_sim.identification.intervals import Estimate, Intervals
from ab_sim.identification.knowledge import Knowledge
from ab_sim.identification.measured import Measured
from ab_sim.identification.residuals import Whiteness
from ab_sim.scene.model import Scene

FITS = "fits"
MISSING = "fits, but something is missing"
OFF = "does not fit"
BOUND = "a value is at its bound"
OPEN = "not identifiable"
NO_BETTER = "no improvement on held-out data"
INTERRUPTED = "interrupted"
"""Verdicts of an identification."""


class RecordingFit(NamedTuple):
    """Recording, and the simulation of the fitted scene for comparison."""

    measured: Measured
    simulated: np.ndarray
    """Simulated signals [m or m/s^2], shape (samples, axes)."""
    held_out: bool
    """True if only the recording's own parameters were fitted."""

    @property
    def residuals(self) -> np.ndarray:
        """Measured minus simulated signals [m or m/s^2], shape (samples, axes)."""
        differences: np.ndarray = self.measured.signals - self.simulated
        return differences


class TriedEffect(NamedTuple):
    """Trial of an effect that the scene lacks, or of an unknown parameter of a recording."""

    name: str
    explains: float
    """Fraction of the residuals' z that the trial removes, 0 to 1."""
    drop: float
    """Reduction of the sum of squares in units of the noise variance."""
    z: float
    """Ljung-Box z with the effect."""
    values: dict[str, float]
    """Fitted values of the added parameters [SI]."""
    failure: str = ""
    """Reason why the trial failed; empty if it did not."""
    nuisance: str = ""
    """Parameter of a recording that was tried: gain, bias, delay, disc_angle or time_scale.

    Empty for an effect.
    """


class HeldOut(NamedTuple):
    """Quality of the fit on recordings that were not fitted."""

    before: float
    """Relative r.m.s. of the residuals with the original scene."""
    after: float
    """Relative r.m.s. of the residuals with the fitted scene."""
    z: float
    """Ljung-Box z with the fitted scene."""

    @property
    def better(self) -> bool:
        """True if the fitted scene predicts these recordings better than the original one."""
        return self.after < self.before


class Proposal(NamedTuple):
    """Proposal for the next recording."""

    name: str
    words: str
    """Instructions for the recording."""
    worst: str
    """Parameter with the widest interval without the recording."""
    now: float
    """Relative half-width of that parameter's interval."""
    then: float
    """Relative half-width of the widest interval with the recording."""
    opens: tuple[str, ...]
    """Names of unknown parameters that the recording would determine."""
    opened: tuple[float, ...] = ()
    """Relative half-width of the interval of each parameter in ``opens``."""

    @property
    def gains(self) -> str:
        """Text on the unknown parameters that the recording would determine; may be empty."""
        return ", ".join(
            f"{name}: unknown -> {share_words(half)}"
            for name, half in zip(self.opens, self.opened, strict=True)
        )


@dataclass(frozen=True, repr=False)
class Identification(Presented):
    """Parameters of a drive identified from recordings, with their uncertainty."""

    _picture = "identification"

    scene: Scene
    """Fitted scene, which can be run."""
    before: Scene
    """Original scene."""
    verdict: str
    """Verdict: ``FITS``, ``MISSING``, ``OFF``, ``BOUND``, ``OPEN``, ``NO_BETTER`` or
    ``INTERRUPTED``."""
    reasons: tuple[str, ...]
    """Reasons of the verdict, a sentence each."""
    intervals: Intervals
    """Estimates with their intervals and covariance."""
    knowledge: Knowledge
    """Identifiability before the fit."""
    whiteness: tuple[Whiteness, ...]
    """Tests of the residuals of each fitted recording."""
    comparisons: tuple[RecordingFit, ...]
    """Each recording with its simulation by the fitted scene; held-out recordings last."""
    tried: tuple[TriedEffect, ...]
    """Trials of effects that the scene may lack, the best first."""
    held_out: HeldOut | None
    """Quality on held-out recordings; None if there are none."""
    proposals: tuple[Proposal, ...]
    """Proposals for the next recording, the best first."""
    notes: tuple[str, ...]
    """Remarks for the user, a sentence each."""
    runs: int
    """Number of simulated runs."""
    seed: int
    """Seed of the random starts."""

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """Estimates of all parameters, those of the scene first."""
        return self.intervals.estimates

    def __getitem__(self, name: str) -> Estimate:
        """Return the estimate of a parameter.

        Raises
        ------
        KeyError
            The name is unknown.
        """
        for estimate in self.estimates:
            if estimate.name == name:
                return estimate
        raise KeyError(f"no parameter {name!r}; there are: {[e.name for e in self.estimates]}")

    def _facts(self) -> dict[str, str]:
        return {
            "scene": self.before.name,
            "verdict": self.verdict,
            "recordings": str(sum(not comparison.held_out for comparison in self.comparisons)),
            "parameters": str(sum(not estimate.per_recording for estimate in self.estimates)),
            "runs": str(self.runs),
        }

    def _columns(self) -> Columns:
        estimates = self.estimates
        names = {"parameter": "name"} | {n: n for n in ("unit", "value", "low", "high", "how")}
        return {
            title: Column(None, [getattr(estimate, name) for estimate in estimates])
            for title, name in names.items()
        }

    def report(self) -> dict[str, object]:
        """Return all results as JSON-able values: docs/reference/json.md.

        Infinite numbers become None: the end of an open interval, or the z of an effect whose run
        diverges, as stated in its ``failure``. The entry ``not_finite`` names their places.
        """
        return finite(
            {
                "scene": self.before.name,
                "verdict": self.verdict,
                "reasons": list(self.reasons),
                "parameters": [estimate._asdict() for estimate in self.estimates],
                "covariance": {
                    "parameters": list(self.intervals.names),
                    "values": self.intervals.covariance.tolist(),
                },
                "correlation": self.intervals.correlation.tolist(),
                "profiles": [profile._asdict() for profile in self.intervals.profiles],
                "knowledge": self.knowledge.report(),
                "residuals": [result.report() for result in self.whiteness],
                "tried_effects": [trial._asdict() for trial in self.tried],
                "held_out": None if self.held_out is None else self.held_out._asdict(),
                "next_recordings": [proposal._asdict() for proposal in self.proposals],
                "notes": list(self.notes),
                "runs": self.runs,
                "seed": self.seed,
                "version": __version__,
                "fitted_scene": self.scene.as_mapping(),
            }
        )

    def scene_text(self) -> str:
        """Return the fitted scene as a file, with a header that states the uncertainty."""
        head = [
            f"# Fitted by ab-sim identify {__version__}: {self.verdict}.",
            *(f"# {text}" for text in (*self.reasons, *self.notes)),
            "# Intervals of 95 %:",
        ]
        head += [
            f"#   {_words_of(estimate)}"
            for estimate in self.estimates
            if not estimate.per_recording
        ]
        return "\n".join(head) + "\n" + yaml_text(self.scene.as_mapping())


def shown_unit(unit: str) -> tuple[str, float]:
    """Return the unit to draw signals in (mm for displacements), and the factor from SI to it."""
    return ("mm", 1e3) if unit == "m" else (unit, 1.0)


def share_words(share: float) -> str:
    """Return the relative half-width of an interval as text: ``2.5 %``, ``unknown`` if infinite."""
    return f"{100.0 * share:.2g} %" if np.isfinite(share) else "unknown"


def _words_of(estimate: Estimate) -> str:
    """Return an estimate and its interval as text; for an open interval, the reason instead."""
    unit = "" if estimate.unit == "1" else f" {estimate.unit}"
    value = f"{estimate.name} = {estimate.value:.6g}{unit}"
    if not np.isfinite(estimate.low) and not np.isfinite(estimate.high):
        return f"{value}, {estimate.how}: any value fits (-inf to inf)"
    return f"{value} ({estimate.low:.6g} to {estimate.high:.6g})"
