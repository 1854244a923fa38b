"""Our cheapest setting beside the best peer at the same error, in one interleaved run.

    python benchmarks/peers.py [--out docs] [--repeats 21]

writes peers.json and peers.png. The scene is the thesis' start-up with a hold, without friction.
Each repeat times all candidates, ours and every peer's settings around the error wanted, one after
the other; a peer's time at exactly that error is interpolated, log-log, between two of its
settings; the ratio is taken repeat by repeat. Needs the extra `peers`.
"""

import math
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments  # noqa: E402
from rich.console import Console  # noqa: E402

from ab_sim.accuracy.deviation import deviation  # noqa: E402
from ab_sim.cli.outputs import write_json  # noqa: E402
from ab_sim.errors import SceneError  # noqa: E402
from ab_sim.integrate.registry import steppers  # noqa: E402
from ab_sim.scene import load_scene  # noqa: E402
from ab_sim.studies.accuracy_cost.cvode_peer import cvode_solvers  # noqa: E402
from ab_sim.studies.accuracy_cost.methods import FailedError, Method  # noqa: E402
from ab_sim.studies.accuracy_cost.mujoco_peer import MuJoCo  # noqa: E402
from ab_sim.studies.accuracy_cost.ours import Stepping  # noqa: E402
from ab_sim.studies.accuracy_cost.reference import Reference, smooth_reference  # noqa: E402
from ab_sim.studies.accuracy_cost.results import peer_versions  # noqa: E402
from ab_sim.studies.accuracy_cost.right_hand_side import RightHandSide  # noqa: E402
from ab_sim.studies.accuracy_cost.sampling import Sampling  # noqa: E402
from ab_sim.studies.accuracy_cost.scipy_peers import SCIPY  # noqa: E402
from ab_sim.studies.accuracy_cost.tolerance import ByTolerance  # noqa: E402
from ab_sim.studies.effect_cost import Spread, conditions  # noqa: E402

SCENE, CHANGES = "thesis-hold", ["effects.rolling_friction="]
WANTED = (1e-6, 1e-9)
"""Errors in ball angle, the largest over the run [rad]."""
GOAL = 60.0
"""Times the CPU time of ours that the best peer is to take at least."""
SAMPLING = Sampling(0.015, 400, 60)
"""Each of ``STEPS`` ends at one of the reference's instants; peers have samples every 15 ms."""
STEPS = (7.5e-3, 5e-3, 3.75e-3, 3e-3, 2.5e-3, 1.5e-3, 1e-3, 0.75e-3, 0.5e-3)
"""All divide the sample period."""
MUJOCO_STEPS = (2e-3, 1e-3, 0.5e-3, 0.25e-3, 0.125e-3)
TOLERANCES = tuple(10.0 ** (-k / 2) for k in range(8, 24))
TOO_SLOW = 10.0
"""Peers that take this much longer than the quickest one at an error are not timed further."""


class Candidate:
    """A method at a setting."""

    def __init__(self, method: Method, f: RightHandSide, reference: Reference) -> None:
        method.prepare()
        method.run()  # compiles
        self.method = method
        self.times: list[float] = []
        samples = self.time_once()
        found = deviation(samples, reference.samples_for(method.name), f.scene.whirl_unit[0])
        self.error = found.angle
        self.first = self.times.pop()

    def time_once(self) -> Any:
        """One run, timed."""
        self.method.prepare()
        begin = time.thread_time()
        kept = self.method.run()
        self.times.append((time.thread_time() - begin) / SAMPLING.end)
        return self.method.samples(kept)

    @property
    def setting(self) -> str:
        """Step or tolerance."""
        method = self.method
        if method.step is not None:
            return f"{1e3 * method.step:g} ms"
        return f"rtol {method.tolerance:.1e}"

    def report(self) -> dict[str, Any]:
        """As JSON-able values."""
        made = self.method.evaluations
        return {
            "method": self.method.name,
            "setting": self.setting,
            "error": self.error,
            "cpu": Spread.of(np.array(self.times))._asdict(),
            "evaluations": None if made is None else made / SAMPLING.end,
        }


def candidates(f: RightHandSide, reference: Reference, console: Console) -> list[Candidate]:
    """Everything, with its error."""
    made: list[Any] = []
    for name in steppers():
        made += [lambda n=name, s=step: Stepping(f.scene, SAMPLING, n, s) for step in STEPS]
    solvers = {name: solver for name, solver in SCIPY.items() if name != "Radau"}
    for name, solver in {**solvers, **cvode_solvers()}.items():
        made += [
            lambda n=name, s=solver, t=rtol: ByTolerance(f, None, n, s, t) for rtol in TOLERANCES
        ]
    made += [lambda s=step: MuJoCo(f.scene, SAMPLING, s) for step in MUJOCO_STEPS]
    found = []
    for make in made:
        try:
            found.append(Candidate(make(), f, reference))
        except (SceneError, FailedError):
            continue
        last = found[-1]
        console.print(
            f"{last.method.name} {last.setting}: {last.error:.1e} rad, {1e3 * last.first:.3g} ms/s"
        )
    return found


def ours_at(found: list[Candidate], error: float) -> Candidate:
    """Our cheapest setting with at most this error."""
    good = [each for each in found if not each.method.peer and each.error <= error]
    return min(good, key=lambda each: each.first)


def brackets(found: list[Candidate], error: float) -> list[tuple[Candidate, Candidate]]:
    """For each peer, neighbouring settings with errors on both sides of the one wanted.

    Peers that are much slower than the quickest are dropped.
    """
    pairs = []
    for name in dict.fromkeys(each.method.name for each in found if each.method.peer):
        mine = [each for each in found if each.method.name == name]
        for coarse, fine in zip(mine, mine[1:], strict=False):
            if fine.error <= error < coarse.error:
                pairs.append((coarse, fine))
                break
    quickest = min(coarse.first for coarse, _ in pairs)
    return [pair for pair in pairs if pair[0].first <= TOO_SLOW * quickest]


def time_at(error: float, coarse: Candidate, fine: Candidate) -> np.ndarray:
    """Time at an error, interpolated log-log, for each repeat."""
    share = math.log(error / coarse.error) / math.log(fine.error / coarse.error)
    times = (np.log(coarse.times), np.log(fine.times))
    return np.asarray(np.exp((1.0 - share) * times[0] + share * times[1]))


def compare(found: list[Candidate], error: float, repeats: int) -> dict[str, Any]:
    """Time ours and the peers at one error, in turns."""
    ours, pairs = ours_at(found, error), brackets(found, error)
    runs = list({id(each): each for each in (ours, *(x for pair in pairs for x in pair))}.values())
    for each in runs:
        each.times.clear()
    for turn in range(repeats):
        for place in range(len(runs)):
            runs[(turn + place) % len(runs)].time_once()
    peers = []
    for coarse, fine in pairs:
        times = time_at(error, coarse, fine)
        peers.append(
            {
                "method": coarse.method.name,
                "between": [coarse.report(), fine.report()],
                "cpu": Spread.of(times)._asdict(),
                "ratio": Spread.of(times / np.array(ours.times))._asdict(),
            }
        )
    peers.sort(key=lambda peer: peer["cpu"]["median"])
    ratio = peers[0]["ratio"]["median"]
    return {
        "error": error,
        "ours": ours.report(),
        "best_peer": peers[0]["method"],
        "ratio": peers[0]["ratio"],
        "goal": GOAL,
        "met": ratio >= GOAL,
        "peers": peers,
    }


def call_costs(f: RightHandSide) -> dict[str, float]:
    """What one evaluation costs [s]: called from Python, as peers do, and in compiled code."""
    import numba

    leg = f.legs[0]
    function, y, numbers = leg.f, f.start, leg.numbers

    @numba.njit
    def loop(count, y):  # type: ignore[no-untyped-def]
        total = 0.0
        for i in range(count):
            total += function(1e-6 * i, y, numbers)[0]
        return total

    loop(1, y)
    count, out = 100_000, {}
    begin = time.thread_time()
    loop(count, y)
    out["compiled"] = (time.thread_time() - begin) / count
    begin = time.thread_time()
    for _ in range(count):
        function(0.1, y, numbers)
    out["from_python"] = (time.thread_time() - begin) / count
    return out


def figure(report: dict[str, Any], path: Path) -> None:
    """Bars: CPU time at equal error, ours and each peer."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    results = report["results"]
    made, axes = plt.subplots(1, len(results), figsize=(11, 3.6), constrained_layout=True)
    for panel, result in zip(axes, results, strict=True):
        ours = result["ours"]
        names = [f"ab_sim\n{ours['method']} at {ours['setting']}"]
        names += [peer["method"] for peer in result["peers"]]
        spreads = [ours["cpu"], *(peer["cpu"] for peer in result["peers"])]
        medians = [1e3 * spread["median"] for spread in spreads]
        whiskers = [
            [1e3 * (s["median"] - s["lower"]) for s in spreads],
            [1e3 * (s["upper"] - s["median"]) for s in spreads],
        ]
        colours = ["tab:red"] + ["tab:blue"] * (len(names) - 1)
        panel.barh(range(len(names)), medians, xerr=whiskers, color=colours, alpha=0.8, capsize=3)
        for place, spread in enumerate(spreads):
            value = medians[place]
            times = (
                "" if place == 0 else f" = {result['peers'][place - 1]['ratio']['median']:.0f} x"
            )
            panel.text(
                1.1e3 * spread["upper"], place, f"{value:.3g} ms{times}", va="center", fontsize=9
            )
        goal = GOAL * medians[0]
        panel.axvline(goal, color="0.4", linestyle=":")
        panel.text(goal, 0.0, f" goal: {GOAL:.0f} x", fontsize=9, color="0.4", va="center")
        panel.set_xscale("log")
        panel.set_xlim(medians[0] / 3, max(*medians, goal) * 12)
        panel.set_yticks(range(len(names)), names)
        panel.invert_yaxis()
        panel.set_xlabel("CPU time per simulated second [ms]")
        panel.set_title(f"error in ball angle {result['error']:g} rad", fontsize=11)
    try:
        made.savefig(path, dpi=120)
    finally:
        plt.close(made)


def main() -> None:
    """Measure and write the two files."""
    asked = arguments("Beside peers, at equal error.", 21).parse_args()
    console = Console(markup=False, highlight=False)
    f = RightHandSide(load_scene(SCENE, CHANGES), SAMPLING)
    reference = smooth_reference(f)
    found = candidates(f, reference, console)
    results = [compare(found, error, asked.repeats) for error in WANTED]
    where = conditions()
    where["versions"].update(peer_versions())
    report = {
        **where,
        "scene": SCENE,
        "changes": CHANGES,
        "duration": SAMPLING.end,
        "repeats": asked.repeats,
        "reference": reference.text,
        "uncertainty": reference.uncertainty._asdict(),
        "seconds_per_evaluation": call_costs(f),
        "results": results,
    }
    write_json(report, str(asked.out / "peers.json"))
    figure(report, asked.out / "peers.png")
    for result in results:
        ratio, ours = result["ratio"], result["ours"]
        console.print(
            f"{result['error']:g} rad: {ours['method']} at {ours['setting']} "
            f"({ours['error']:.1e} rad) takes {1e3 * ours['cpu']['median']:.3g} ms/s; "
            f"{result['best_peer']} {ratio['median']:.1f} times as much "
            f"({ratio['lower']:.1f} to {ratio['upper']:.1f}); the goal, {GOAL:.0f}, is "
            f"{'met' if result['met'] else 'not met'}"
        )


if __name__ == "__main__":
    main()
