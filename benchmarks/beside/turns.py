"""Methods at their settings, timed in turns, and what one takes at just the error of another."""

import math
import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from ab_sim.analysis.effect_cost import Quartiles
from ab_sim.base.errors import AbSimError

MOST_TIME = 4.0
"""s of CPU time that the repeats of one setting may take; slow ones take part in fewer."""
HOPELESS = 0.4
"""s. After a run that takes longer, a method's further settings are left out."""
WRONG = 1e-5
"""rad. A method whose least error is no less does not solve these equations."""


class AbsentError(Exception):
    """A method cannot be had here; the text says why, and what to install."""


class Setting(Protocol):
    """A method at one setting, ready to run."""

    method: str
    setting: str
    """Step or tolerance, for people."""
    ours: bool
    continuous: bool
    """Whether what lies between two of its settings can be had as well."""
    simulated: float
    """s in one run, of all its runs together if it is a batch."""
    evaluations: float | None
    """Of the right-hand side in the last run; None where unknown."""

    def once(self) -> tuple[float, Any]:
        """One run from the start: its CPU time [s], and what it returned."""

    def error(self, kept: Any) -> float:
        """The largest in a ball's angle over a run [rad]."""


def timed(run: Callable[[], Any]) -> tuple[float, Any]:
    """CPU time of a call [s], and what it returned."""
    begin = time.thread_time()
    kept = run()
    return time.thread_time() - begin, kept


class Candidate:
    """A setting, with its error and its times.

    Args:
        make: makes the setting.

    Raises:
        AbSimError: it is refused, or cannot finish.
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
        """Time one run, unless it has had its share.

        Just after another, as in a study: of a run of 0.1 ms a fifth would else be other methods'
        code leaving the processor's caches, and most where a method's turn begins.
        """
        if number < max(1, int(MOST_TIME / max(self.seconds, 1e-9))):
            self.of.once()
            self.times.append(self.of.once()[0] / self.of.simulated)

    @property
    def median(self) -> float:
        """CPU time per simulated second."""
        return float(np.median(self.times))

    def report(self) -> dict[str, Any]:
        """As JSON-able values."""
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
    """What was not measured, and why."""

    method: str
    reason: str


VERDICT = {True: "met", False: "**not met**", None: "not judged"}
"""Of ``met``, in words; None where peers are missing, or none is so accurate."""
Maker = Callable[[], Setting]
Family = tuple[str, Callable[[], Iterable[tuple[str, Maker]]]]
"""A method: its name, and what lists its settings; that raises AbsentError."""


def candidates(
    families: Sequence[Family], say: Callable[[str], None]
) -> tuple[list[Candidate], list[LeftOut]]:
    """All settings of all methods with their errors, checked; and what is left out."""
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
    """Time them, each round beginning with another one."""
    for turn in range(repeats):
        for place in range(len(found)):
            found[(turn + place) % len(found)].turn(turn)


def front(mine: Sequence[Candidate]) -> list[Candidate]:
    """Those that no other one of them beats at both error and time, from coarse to fine."""
    best: list[Candidate] = []
    for each in sorted(mine, key=lambda one: (one.error, one.median)):
        if not best or each.median < best[-1].median:
            best.append(each)
    return best[::-1]


def reports(found: Sequence[Candidate]) -> list[dict[str, Any]]:
    """As JSON-able values; whether each is on its method's front."""
    rows = []
    for method in dict.fromkeys(each.of.method for each in found):
        mine = [each for each in found if each.of.method == method]
        best = front(mine)
        rows += [each.report() | {"on_front": each in best} for each in mine]
    return rows


class AtError(NamedTuple):
    """What a method takes at an error."""

    times: np.ndarray
    """CPU time per simulated second, repeat by repeat."""
    between: tuple[str, ...]
    """The settings that it is interpolated between, or the one it is of."""


def at_error(mine: Sequence[Candidate], error: float) -> AtError | None:
    """Interpolated log-log along a method's front; None if it does not reach the error.

    A method whose coarsest setting of use has less error takes the time of that one; one whose
    settings are not continuous, of the coarsest that has no more error.
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
    """All methods at one error, beside the quickest of ours that are ``named``.

    Whether the goal is met is not judged unless ``complete``: the best peer may be missing.
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
    """How the best peer compares at an error, as a part of a sentence."""
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
