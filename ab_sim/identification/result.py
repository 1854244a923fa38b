"""What an identification has found."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

import ab_sim
from ab_sim.identification.intervals import Estimate, Intervals
from ab_sim.identification.knowledge import Knowledge
from ab_sim.identification.measured import Measured
from ab_sim.identification.residuals import Whiteness
from ab_sim.limited_yaml import yaml_text
from ab_sim.presentation import Column, Columns, Presented, finite_or_none
from ab_sim.scene.model import Scene

FITS = "fits"
MISSING = "fits, but something is missing"
OFF = "does not fit"
BOUND = "a value is at its bound"
OPEN = "not identifiable"
NO_BETTER = "no improvement on held-out data"
INTERRUPTED = "interrupted"


class RecordingFit(NamedTuple):
    """A recording beside the fitted run of it."""

    measured: Measured
    simulated: np.ndarray
    """Shape as the signals."""
    held_out: bool
    """Whether it was not fitted, but for what is its own."""

    @property
    def residuals(self) -> np.ndarray:
        """Measured less simulated."""
        found: np.ndarray = self.measured.signals - self.simulated
        return found


class TriedEffect(NamedTuple):
    """An effect that the scene does not have, or what a recording has of its own, tried once."""

    name: str
    explains: float
    """Which part of the sum of squares beyond noise it takes away, 0 to 1."""
    drop: float
    """Of the sum of squares, in units of the noise's variance."""
    z: float
    """Of Ljung and Box with it."""
    values: dict[str, float]
    """Of its parameters, as fitted."""
    failure: str = ""
    """Why it could not be tried."""
    nuisance: str = ""
    """What a recording has of its own, where that was tried: gain, bias, delay, disc_angle or
    time_scale."""

    def report(self) -> dict[str, Any]:
        """As JSON-able values."""
        return self._asdict()


class HeldOut(NamedTuple):
    """How the fitted scene does on recordings that were not fitted."""

    before: float
    """R.m.s. of the residuals with the scene as it was, of the signals' r.m.s."""
    after: float
    """With the fitted scene."""
    z: float
    """Of Ljung and Box with the fitted scene."""

    @property
    def better(self) -> bool:
        """Whether the fit has helped."""
        return self.after < self.before


class Proposal(NamedTuple):
    """A recording that could be made next."""

    name: str
    words: str
    """What is to be done."""
    worst: str
    """The parameter that is known worst without it."""
    now: float
    """Half the interval of that, as a share of its value."""
    then: float
    """The same of whichever is worst with it."""
    opens: tuple[str, ...]
    """Parameters that it would make known."""
    opened: tuple[float, ...] = ()
    """Half the interval of each of these with it, as a share of its value."""

    def report(self) -> dict[str, Any]:
        """Fields by name."""
        return self._asdict()

    @property
    def gains(self) -> str:
        """What it makes known, and how well, in words; empty if nothing that was open."""
        return ", ".join(
            f"{name}: unknown -> {share_words(half)}"
            for name, half in zip(self.opens, self.opened, strict=True)
        )


@dataclass(frozen=True, repr=False)
class Identification(Presented):
    """Numbers of a drive from its recordings, and how far to believe them."""

    _picture = "ab_sim.figures.identification:drawn_identification"

    scene: Scene
    """The fitted one, which runs as it is."""
    before: Scene
    """The one that it began with."""
    verdict: str
    """``FITS``, ``MISSING``, ``OFF``, ``BOUND``, ``OPEN``, ``NO_BETTER`` or ``INTERRUPTED``."""
    reasons: tuple[str, ...]
    """Of the verdict, a sentence each."""
    intervals: Intervals
    knowledge: Knowledge
    """Before the fit."""
    whiteness: tuple[Whiteness, ...]
    comparisons: tuple[RecordingFit, ...]
    tried: tuple[TriedEffect, ...]
    """Effects that were tried because something is missing, the best first."""
    held_out: HeldOut | None
    proposals: tuple[Proposal, ...]
    """The best first."""
    notes: tuple[str, ...]
    runs: int
    """That were made."""
    seed: int

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """Of all parameters, those of the scene first."""
        return self.intervals.estimates

    def __getitem__(self, name: str) -> Estimate:
        """The estimate of a parameter.

        Raises
        ------
        KeyError
            There is none of that name.
        """
        for each in self.estimates:
            if each.name == name:
                return each
        raise KeyError(f"no parameter {name!r}; there are: {[e.name for e in self.estimates]}")

    def _facts(self) -> dict[str, str]:
        return {
            "scene": self.before.name,
            "verdict": self.verdict,
            "recordings": str(sum(not each.held_out for each in self.comparisons)),
            "parameters": str(sum(not each.own for each in self.estimates)),
            "runs": str(self.runs),
        }

    def _columns(self) -> Columns:
        found = self.estimates
        return {
            "parameter": Column(None, [each.name for each in found]),
            "unit": Column(None, [each.unit for each in found]),
            "value": Column(None, [each.value for each in found]),
            "low": Column(None, [each.low for each in found]),
            "high": Column(None, [each.high for each in found]),
            "how": Column(None, [each.how for each in found]),
        }

    def report(self) -> dict[str, object]:
        """Everything as JSON-able values: ``ab-sim identify --help``.

        A number that is not finite is None: the end of an open interval, or the z of an effect
        whose run diverges, which its ``failure`` says.
        """
        found: dict[str, object] = finite_or_none(
            {
                "scene": self.before.name,
                "verdict": self.verdict,
                "reasons": list(self.reasons),
                "parameters": [each.report() for each in self.estimates],
                "covariance": {
                    "parameters": list(self.intervals.names),
                    "values": self.intervals.covariance.tolist(),
                },
                "correlation": self.intervals.correlation.tolist(),
                "profiles": [each._asdict() for each in self.intervals.profiles],
                "knowledge": self.knowledge.report(),
                "residuals": [each.report() for each in self.whiteness],
                "tried_effects": [each.report() for each in self.tried],
                "held_out": None if self.held_out is None else self.held_out._asdict(),
                "next_recordings": [each.report() for each in self.proposals],
                "notes": list(self.notes),
                "runs": self.runs,
                "seed": self.seed,
                "version": ab_sim.__version__,
                "fitted_scene": self.scene.as_mapping(),
            }
        )
        return found

    def scene_text(self) -> str:
        """The fitted scene as a file, with a head that says how sure its numbers are."""
        head = [
            f"# Fitted by ab-sim identify {ab_sim.__version__}: {self.verdict}.",
            *(f"# {text}" for text in (*self.reasons, *self.notes)),
            "# Intervals of 95 %:",
        ]
        head += [f"#   {words_of(each)}" for each in self.estimates if not each.own]
        return "\n".join(head) + "\n" + yaml_text(self.scene.as_mapping())


def shown_unit(unit: str) -> tuple[str, float]:
    """In which signals are drawn, and the factor to it: displacements in mm."""
    return ("mm", 1e3) if unit == "m" else (unit, 1.0)


def share_words(share: float) -> str:
    """Half an interval, as a share of its value."""
    return f"{100.0 * share:.2g} %" if np.isfinite(share) else "unknown"


def words_of(each: Estimate) -> str:
    """A number with its interval, or what is known instead."""
    unit = "" if each.unit == "1" else f" {each.unit}"
    value = f"{each.name} = {each.value:.6g}{unit}"
    if not np.isfinite(each.low) and not np.isfinite(each.high):
        return f"{value}, {each.how}: any value fits (-inf to inf)"
    return f"{value} ({each.low:.6g} to {each.high:.6g})"
