"""The package's steppers and the best integrators of others, measured in one interleaved run.

    pip install 'ab_sim[peers]' heyoka; apt install g++ libsundials-dev
    python benchmarks/peers.py [--avx2] [--out docs] [--repeats 21]

writes peers.json and peers.png; limited to AVX2, peers-avx2.json and peers-avx2.png. The drive is
the thesis' start-up with a hold, without friction. All methods have output every 5 ms, restart at
the kinks of the speed profile, and are compared with one reference at all outputs before any
timing: a method with other equations is left out. Each round runs every method at every setting
once; slow settings take part in fewer rounds. Times at a given error are interpolated log-log along
a method's front, repeat by repeat, for all methods alike; so are ratios. A method that is not
available is left out with the reason.
"""

import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments  # noqa: E402
from beside import expert_peer, heyoka_peer, ours, python_peers, sundials_peer, width  # noqa: E402
from beside.case import CONDITIONS, VARIATIONS, BatchCase, Case  # noqa: E402
from beside.picture import picture  # noqa: E402
from beside.turns import candidates, compare, reports, take_turns, verdict  # noqa: E402
from rich.console import Console  # noqa: E402

from ab_sim.analysis.accuracy_cost.results import peer_versions  # noqa: E402
from ab_sim.analysis.effect_cost import conditions  # noqa: E402
from ab_sim.cli.outputs import write_json  # noqa: E402

WANTED = (1e-6, 1e-9, 1e-12)
"""Errors in ball angle, the largest over the run [rad]."""
GOAL, BATCH_GOAL, CASE_GOAL = 5.0, 2.5, 3.0
"""Goals: least ratio of the best peer's time to ours, for single runs, batches and other cases."""
BY_OTHERS = (heyoka_peer, expert_peer, sundials_peer)
OTHERS = {
    "five balls": ("balls.count=5", "start.ball_angles=[0.0,0.4,0.8,2.0,3.0]"),
    "drag x 100": ("effects.viscous_drag.coefficient=100",),
    "no drag": ("effects.viscous_drag=",),
    "900 rad/s": (
        "profile.acceleration=900",
        "profile.target_speed=900",
        "profile.variable_speed_period=",
        "spindle.max_speed=900",
        "spindle.max_acceleration=900",
        "start.ball_angles=[0.0,0.5]",
    ),
}
"""Changes of further cases, for the peers that compile their own equations."""
CALLED = {
    "ab_sim": ours.CALLED,
    "heyoka": heyoka_peer.CALLED,
    "in C++": expert_peer.CALLED,
    "in C": sundials_peer.CALLED,
    "from Python, MuJoCo": python_peers.CALLED,
}


def measure(repeats: int, console: Console) -> tuple[Case, dict[str, Any]]:
    """Measure single runs and batches separately."""
    case, batch = Case(), BatchCase()
    families = [
        *ours.families(case),
        *heyoka_peer.families(case),
        *expert_peer.families(case),
        *sundials_peer.families(case),
        *python_peers.families(case),
    ]
    batches = [
        *ours.batch_families(batch),
        *heyoka_peer.batch_families(batch),
        *expert_peer.batch_families(batch),
    ]
    (single, left_out), (many, also) = (candidates(x, console.print) for x in (families, batches))
    for found in (single, many):
        take_turns(found, repeats)
    missing = {each.method for each in (*left_out, *also)}
    all_here, batches_here = (
        missing.isdisjoint(name for name, _ in x) for x in (families, batches)
    )
    return case, {
        "cases": [
            {"case": name, **other_case(changes, repeats, console)}
            for name, changes in OTHERS.items()
        ],
        "left_out": [each._asdict() for each in (*left_out, *also)],
        "rows": reports(single),
        "at": [compare(single, error, _is_whole, GOAL, all_here) for error in WANTED],
        "loop_at": [compare(single, error, _is_loop, GOAL, all_here) for error in WANTED],
        "batch": {
            "runs": len(VARIATIONS),
            "rows": reports(many),
            "at": [compare(many, error, _is_kernel, BATCH_GOAL, batches_here) for error in WANTED],
        },
    }


def other_case(changes: tuple[str, ...], repeats: int, console: Console) -> dict[str, Any]:
    """Measure the package's steppers and the peers that compile their own equations on a case."""
    case = Case(changes)
    families = [
        *ours.families(case),
        *heyoka_peer.families(case),
        *expert_peer.families(case),
        *sundials_peer.families(case),
    ]
    found, left_out = candidates(families, console.print)
    take_turns(found, repeats)
    complete = {each.method for each in left_out}.isdisjoint(name for name, _ in families)
    return {
        "changes": changes,
        "reference": case.reference.text,
        "uncertainty": case.reference.uncertainty._asdict(),
        "rows": reports(found),
        "at": [compare(found, error, _is_whole, CASE_GOAL, complete) for error in WANTED],
        "left_out": [each._asdict() for each in left_out],
    }


def _is_whole(method: str) -> bool:
    return not _is_loop(method)


def _is_loop(method: str) -> bool:
    return method.endswith(ours.LOOP)


def _is_kernel(method: str) -> bool:
    return method.endswith(ours.KERNEL)


def main() -> None:
    """Measure and write the two files."""
    parser = arguments("Beside peers, at equal error.", 21)
    parser.add_argument("--avx2", action="store_true", help="with vectors of AVX2, not AVX-512")
    asked = parser.parse_args()
    if asked.avx2:
        width.limit()
    name = "peers-avx2" if asked.avx2 else "peers"
    console = Console(markup=False, highlight=False, soft_wrap=True)
    case, found = measure(asked.repeats, console)
    where = conditions()
    for versions in (peer_versions, *(of.versions for of in BY_OTHERS)):
        where["versions"].update(versions())
    report = {
        **where,
        **CONDITIONS,
        "vectors": width.vectors(),
        "repeats": asked.repeats,
        "reference": case.reference.text,
        "uncertainty": case.reference.uncertainty._asdict(),
        "called": CALLED,
        **found,
    }
    write_json(report, str(asked.out / f"{name}.json"))
    picture(report, asked.out / f"{name}.png")
    for what, results in (
        ("one run", report["at"]),
        ("its compiled loop", report["loop_at"]),
        ("batch of 8", report["batch"]["at"]),
        *((other["case"], other["at"]) for other in report["cases"]),
    ):
        for result in results:
            console.print(f"{what}: {verdict(result)}")


if __name__ == "__main__":
    main()
