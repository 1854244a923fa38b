"""Timing of methods at several settings in turns, and interpolation at equal errors."""

import math
import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from ab_sim.analysis.effect_cost import Quartiles
from ab_sim.base.errors import AbSimError

MOST_TIME = 4.0
"""CPU time for the repeats of one setting [s]; slow settings take part in fewer rounds."""
HOPELESS = 0.4
"""Time of a run above which a method's further settings are left out [s]."""
WRONG = 1e-5
"""Least error of a method above which it does not solve these equations [rad]."""


class AbsentError(Exception):
    """Error: a method is not available here; the text states the reason and what to install."""


class Setting(Protocol):
    """Method at one setting, ready to run."""

    method: str
    setting: str
    """Step or tolerance as text."""
    ours: bool
    continuous: bool
    """True if settings between two of its settings exist as well."""
    simulated: float
    """Simulated time of one run [s], of all its runs together for a batch."""
    evaluations: float | None
    """Number of evaluations of the right-hand side in the last run; None if unknown."""

    def once(self) -> tuple[float, Any]:
        """Run once from the start; return the CPU time [s] and the result."""

    def error(self, kept: Any) -> float:
        """Return the largest error in a ball's angle over a run [rad]."""


def timed(run: Callable[[], Any]) -> tuple[float, Any]:
    """Call a function; return its CPU time [s] and its result."""
    begin = time.thread_time()
    kept = run()
    return time.thread_time() - begin, kept


class Candidate:
    """Setting with its error and times.

    Parameters
    ----------
    make
        Function that creates the setting.

    Raises
    ------
    AbSimError
        The setting is refused, or its run fails.
    """

    def __init__(self, make: Callable[[], Setting]) -> None:
        begin = time.process_time()  # compilers may use threads
        self.of = make()
        self.of.once()
        self.first = time.process_time() - begin
        self.seconds, kept = self.of.once()
        self.error = self.of.error(kept)
        if not math.isfinite(self.error):
            raise AbSimError("its error is not finite")
        self.times: list[float] = []

    def turn(self, number: int) -> None:
        """Time one run, unless the setting has used its time.

        The timed run follows another run of the same setting, as in a study. Otherwise, for a run
        of 0.1 ms, a fifth of the time would be cache misses after other methods' code.
        """
        if number < max(1, int(MOST_TIME / max(self.seconds, 1e-9))):
            self.of.once()
            self.times.append(self.of.once()[0] / self.of.simulated)

    @property
    def median(self) -> float:
        """Return the median of the CPU time per simulated second."""
        return float(np.median(self.times))

    def report(self) -> dict[str, Any]:
        """Return JSON-able values."""
        of = self.of
        return {
            "method": of.method,
            "setting": of.setting,
            "ours": of.ours,
            "error": self.error,
            "cpu": Quartiles.of(np.array(self.times))._asdict(),
            "repeats": len(self.times),
            "evaluations": None if of.evaluations is None else of.evaluations / of.simulated,
            "first": self.first,
        }


class LeftOut(NamedTuple):
    """Method or setting that was not measured, and the reason."""

    method: str
    reason: str


VERDICT = {True: "met", False: "**not met**", None: "not judged"}
"""Texts for the values of ``met``; None if peers are missing, or none is accurate enough."""
Maker = Callable[[], Setting]
Family = tuple[str, Callable[[], Iterable[tuple[str, Maker]]]]
"""Method: its name, and a function that lists its settings or raises AbsentError."""


def candidates(
    families: Sequence[Family], say: Callable[[str], None]
) -> tuple[list[Candidate], list[LeftOut]]:
    """Return all settings of all methods with checked errors, and those left out."""
    found: list[Candidate] = []
    left_out: list[LeftOut] = []
    for name, settings in families:
        mine = []
        try:
            for setting, make in settings():
                try:
                    mine.append(Candidate(make))
                except AbSimError as error:
                    left_out.append(LeftOut(f"{name} at {setting}", str(error)))
                    continue
                last = mine[-1]
                say(f"{name} {setting}: {last.error:.1e} rad, first run after {last.first:.2g} s")
                if last.seconds > HOPELESS:
                    reason = f"a run at {setting} takes {last.seconds:.1f} s"
                    left_out.append(LeftOut(f"{name} at further settings", reason))
                    break
        except AbsentError as error:
            left_out.append(LeftOut(name, f"absent: {error}"))
            say(f"{name}: {error}")
        least = min((each.error for each in mine), default=0.0)
        if least >= WRONG:
            left_out.append(
                LeftOut(name, f"its least error is {least:.1e} rad: it solves something else")
            )
            say(f"{name}: off by {least:.1e} rad, left out")
            continue
        found += mine
    return found, left_out


def take_turns(found: Sequence[Candidate], repeats: int) -> None:
    """Time all settings in rounds, each of which starts with another setting."""
    for turn in range(repeats):
        for place in range(len(found)):
            found[(turn + place) % len(found)].turn(turn)


def front(mine: Sequence[Candidate]) -> list[Candidate]:
    """Return the settings that no other one beats in both error and time, from coarse to fine."""
    best: list[Candidate] = []
    for each in sorted(mine, key=lambda one: (one.error, one.median)):
        if not best or each.median < best[-1].median:
            best.append(each)
    return best[::-1]


def reports(found: Sequence[Candidate]) -> list[dict[str, Any]]:
    """Return JSON-able values, and whether each setting is on its method's front."""
    rows = []
    for method in dict.fromkeys(each.of.method for each in found):
        mine = [each for each in found if each.of.method == method]
        best = front(mine)
        rows += [each.report() | {"on_front": each in best} for each in mine]
    return rows


class AtError(NamedTuple):
    """Time of a method at an error."""

    times: np.ndarray
    """CPU time per simulated second for each repeat."""
    between: tuple[str, ...]
    """Settings between which the time is interpolated, or the single setting."""


def at_error(mine: Sequence[Candidate], error: float) -> AtError | None:
    """Interpolate the time log-log along a method's front; None if it does not reach the error.

    If the coarsest useful setting has a smaller error, its time is used. A method without
    intermediate settings has the time of the coarsest setting with a sufficiently small error.
    """
    line = front(mine)
    fine = next((k for k, each in enumerate(line) if each.error <= error), None)
    if fine is None:
        return None
    last = line[fine]
    if fine == 0 or not last.of.continuous:
        return AtError(np.array(last.times), (last.of.setting,))
    coarse = line[fine - 1]
    share = math.log(error / coarse.error) / math.log(max(last.error, 1e-16) / coarse.error)
    rounds = min(len(coarse.times), len(last.times))
    times = (np.log(coarse.times[:rounds]), np.log(last.times[:rounds]))
    return AtError(
        np.exp((1.0 - share) * times[0] + share * times[1]),
        (coarse.of.setting, last.of.setting),
    )


def compare(
    found: Sequence[Candidate],
    error: float,
    named: Callable[[str], bool],
    goal: float,
    complete: bool,
) -> dict[str, Any]:
    """Compare all methods at one error with the fastest of the package's ``named`` methods.

    The goal is judged only if the peers are ``complete``, because the best one may be missing.
    """
    methods = dict.fromkeys(each.of.method for each in found)
    own = {each.of.method for each in found if each.of.ours}
    reached = {}
    for method in methods:
        at = at_error([each for each in found if each.of.method == method], error)
        if at is not None:
            reached[method] = at
    order = sorted(reached, key=lambda method: float(np.median(reached[method].times)))
    best = next((method for method in order if method in own and named(method)), None)
    rows = []
    for method in order:
        at = reached[method]
        row = {
            "method": method,
            "ours": method in own,
            "between": at.between,
            "cpu": Quartiles.of(at.times)._asdict(),
        }
        if best is not None:
            rounds = min(len(at.times), len(reached[best].times))
            ratio = Quartiles.of(at.times[:rounds] / reached[best].times[:rounds])
            row["ratio"] = ratio._asdict()
        rows.append(row)
    peer = next((row for row in rows if not row["ours"]), None)
    ratio = peer["ratio"] if peer is not None and best is not None else None
    met = None if peer is None else ratio is not None and ratio["median"] >= goal
    return {
        "error": error,
        "ours": best,
        "best_peer": None if peer is None else peer["method"],
        "ratio": ratio,
        "goal": goal,
        "met": met if complete else None,
        "rows": rows,
    }


def verdict(result: dict[str, Any]) -> str:
    """Return the best peer's relative time at an error, as a part of a sentence."""
    error, ours, peer = f"{result['error']:g} rad", result["ours"], result["best_peer"]
    if peer is None:
        return f"at {error} there is no peer"
    judged = VERDICT[result["met"]]
    if ours is None:
        return f"at {error} there is {peer}, but none of ours that is compared ({judged})"
    ratio = result["ratio"]
    return (
        f"at {error} the best peer, {peer}, takes {ratio['median']:.3g} ({ratio['lower']:.3g} to "
        f"{ratio['upper']:.3g}) times as much as {ours} (goal: {result['goal']:g}, {judged})"
    )
