"""Resting states over spindle speed: branches, folds, stability changes, and gaps."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeVar

import numpy as np
from scipy.optimize import brentq

from ab_sim.analysis.equilibria.patterns import Fold
from ab_sim.analysis.equilibria.states import RestingState

StateAtSpeed = Callable[[float], RestingState]
"""Function that returns the state of a branch at a speed [rad/s]."""


class Crossing(NamedTuple):
    """Speed at which small disturbances change between growth and decay."""

    speed: float
    """Spindle speed [rad/s]."""
    label: str
    """Label of the branch."""
    W: float
    """Radius of the whirl [m]."""
    frequency: float
    """Imaginary part of the crossing eigenvalue [rad/s]; 0 if it is real."""
    gains: bool
    """True if the state is stable above the speed."""

    @property
    def kind(self) -> str:
        """Type of the crossing: ``Hopf`` or ``real``."""
        return "Hopf" if self.frequency > 0.0 else "real"

    def report(self) -> dict[str, Any]:
        """Return the crossing as JSON-able values."""
        return {**self._asdict(), "kind": self.kind}


class StateSummary(NamedTuple):
    """Stored part of a branch's state at a speed: see ``RestingState``."""

    W: float
    """Radius of the whirl [m]."""
    theta: list[float]
    """Ball angles [rad]."""
    lambda_max: float
    """Largest growth rate [1/s]."""
    stable: bool | None
    """Verdict of the linear test; None if undecided."""

    @classmethod
    def of(cls, state: RestingState) -> "StateSummary":
        """Return the summary of a state."""
        return cls(state.W, state.theta.tolist(), state.lambda_max, state.stable)


@dataclass(frozen=True)
class BranchInterval:
    """Part of a branch over speeds between which no resting state of its pattern begins or ends."""

    label: str
    """Label of the branch, as in ``RestingState``."""
    states: tuple[StateSummary, ...]
    """States along the branch."""
    speeds: np.ndarray
    """Speeds [rad/s], rising, one per state."""
    crossings: tuple[Crossing, ...]
    """Changes of stability, by rising speed."""

    def having(self, stable: bool | None) -> list[tuple[float, float]]:
        """Return the speed ranges [rad/s] in which the linear test gives a verdict.

        Parameters
        ----------
        stable
            Verdict: True, False, or None for undecided.
        """
        edges = [self.speeds[0], *(crossing.speed for crossing in self.crossings), self.speeds[-1]]
        middles = [0.5 * (a + b) for a, b in zip(edges[:-1], edges[1:], strict=True)]
        near = [int(np.argmin(np.abs(self.speeds - x))) for x in middles]
        ranges = zip(edges[:-1], edges[1:], near, strict=True)
        return [(float(a), float(b)) for a, b, k in ranges if self.states[k].stable is stable]


@dataclass(frozen=True)
class OverSpeed:
    """Branches over a range of speeds."""

    speeds: tuple[float, float]
    """Lowest and highest speed [rad/s]."""
    intervals: tuple[BranchInterval, ...]
    """Branches, cut at folds."""
    folds: tuple[tuple[str, Fold], ...]
    """Folds by rising speed, each with its pattern's label."""

    @property
    def crossings(self) -> list[Crossing]:
        """Crossings of all intervals, by rising speed."""
        return sorted(crossing for interval in self.intervals for crossing in interval.crossings)

    @property
    def without_state(self) -> list[tuple[float, float]]:
        """Ranges of speed [rad/s] without a resting state."""
        return _others(self.speeds, [(s.speeds[0], s.speeds[-1]) for s in self.intervals])

    @property
    def without_stable_state(self) -> list[tuple[float, float]]:
        """Ranges of speed [rad/s] without a state that is stable by the linear test."""
        return _others(self.speeds, [r for s in self.intervals for r in s.having(True)])

    @property
    def undecided(self) -> list[tuple[float, float]]:
        """Speed ranges [rad/s] without a stable state, but with a state that is undecided."""
        ranges = [r for s in self.intervals for r in s.having(None)]
        decided = [r for s in self.intervals for r in s.having(True)]
        return _others(self.speeds, [*decided, *_others(self.speeds, ranges)])

    def report(self) -> dict[str, Any]:
        """Return the branches as JSON-able values."""
        return {
            "speeds": list(self.speeds),
            "folds": [{"label": label, **fold._asdict()} for label, fold in self.folds],
            "crossings": [crossing.report() for crossing in self.crossings],
            "without_state": [list(r) for r in self.without_state],
            "without_stable_state": [list(r) for r in self.without_stable_state],
            "undecided": [list(r) for r in self.undecided],
            "branches": [
                {
                    "label": interval.label,
                    "speeds": interval.speeds.tolist(),
                    **{
                        key: [getattr(x, key) for x in interval.states]
                        for key in StateSummary._fields
                    },
                    "crossings": [crossing.report() for crossing in interval.crossings],
                }
                for interval in self.intervals
            ],
        }

    @classmethod
    def of(cls, report: dict[str, Any]) -> "OverSpeed":
        """Return the branches of a ``report``."""
        intervals = [
            BranchInterval(
                item["label"],
                tuple(map(StateSummary, *(item[key] for key in StateSummary._fields))),
                np.array(item["speeds"]),
                tuple(_of(Crossing, one) for one in item["crossings"]),
            )
            for item in report["branches"]
        ]
        folds = [(fold["label"], _of(Fold, fold)) for fold in report["folds"]]
        low, high = report["speeds"]
        return cls((low, high), tuple(intervals), tuple(folds))


Item = TypeVar("Item", Crossing, Fold)


def _of(kind: type[Item], report: dict[str, Any]) -> Item:
    """Return the crossing or fold in a report; further keys are ignored."""
    return kind(**{key: report[key] for key in kind._fields})


_SAME = 1e-7
"""Relative distance below which two ranges touch: branches that continue across a fold."""


def _others(
    whole: tuple[float, float], ranges: Sequence[tuple[float, float]]
) -> list[tuple[float, float]]:
    """Return the parts of ``whole`` that no range covers."""
    gaps, reached = [], whole[0]
    for low, high in sorted(ranges):
        if low > reached + _SAME * abs(low):
            gaps.append((float(reached), float(low)))
        reached = max(reached, high)
    if whole[1] > reached + _SAME * abs(reached):
        gaps.append((float(reached), float(whole[1])))
    return gaps


def interval_of(label: str, at: StateAtSpeed, speeds: np.ndarray) -> BranchInterval:
    """Return a branch with its states at speeds and the crossings located between them.

    Parameters
    ----------
    label
        Label of the branch.
    at
        Function that returns the state at a speed.
    speeds
        Rising speeds [rad/s].
    """
    states = tuple(at(float(w)) for w in speeds)
    crossings = tuple(_crossings(label, at, speeds, states))
    return BranchInterval(
        label, tuple(map(StateSummary.of, states)), np.asarray(speeds, float), crossings
    )


def _crossings(
    label: str, at: StateAtSpeed, speeds: np.ndarray, states: Sequence[RestingState]
) -> Iterator[Crossing]:
    """Yield the speeds at which lambda_max changes its sign, see ``interval_of``.

    States whose sign may be due to rounding are skipped.
    """
    decided = [k for k, state in enumerate(states) if state.stable is not None]
    for one, two in zip(decided[:-1], decided[1:], strict=True):
        if states[one].stable is states[two].stable:
            continue
        speed = float(
            brentq(lambda w: at(w).lambda_max, speeds[one], speeds[two], xtol=1e-300, rtol=1e-14)
        )
        if np.abs(speed - speeds[[0, -1]]).min() <= _SAME * speed:
            continue  # lambda_max is 0 at a fold: no change along this branch
        state = at(speed)
        nearest = state.eigenvalues[np.argsort(np.abs(state.eigenvalues.real - state.lambda_max))]
        frequency = float(np.abs(nearest[0].imag))
        yield Crossing(speed, label, state.W, frequency, bool(states[two].stable))


def grid_between(low: float, high: float, speeds: np.ndarray) -> np.ndarray:
    """Return speeds strictly within a range [rad/s], denser near its ends, where branches meet.

    Parameters
    ----------
    low, high
        Ends of the range [rad/s].
    speeds
        Rising speeds [rad/s]; those within the range are part of the result.
    """
    inside = speeds[(speeds > low) & (speeds < high)]
    ends = 0.5 * (1.0 - np.cos(np.linspace(0.0, math.pi, 12)[1:-1]))
    width = high - low
    near = np.concatenate([[1e-12], np.geomspace(1e-8, 1e-2, 4)])
    more = low + width * np.concatenate([near, ends, 1.0 - near])
    return np.unique(np.concatenate([inside, more[(more > low) & (more < high)]]))
