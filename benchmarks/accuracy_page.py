"""Write docs/accuracy.md from what the benchmarks have measured.

    python benchmarks/accuracy_page.py [--docs docs]

after accuracy_cost.py, peers.py with and without --avx2, collocation_step_cost.py, collocation.py,
collocation_at_random.py, step_cost.py and batch_throughput.py.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from beside.page import limited_part, peers_part  # noqa: E402
from collocation_page import collocation_part  # noqa: E402
from collocation_step_page import collocation_step_part  # noqa: E402
from page_parts import conditions, error, left_out_list, sentence, spread, table  # noqa: E402

from ab_sim.accuracy import SAFETY  # noqa: E402

DOCS = Path(__file__).resolve().parents[1] / "docs"
LIMITED = """### With vectors of {limited_vectors}

The same process of measuring with all code limited: ours, by `AB_SIM_CPU_FEATURES`, and what a C++
or C compiler makes. heyoka has no such setting; its batches are two of four runs here, and its code
still uses the 32 registers of AVX-512 where there are such, which is in its favour. The
{limited_most} quickest at each error:

{limited_table}

{limited_verdict}

Eight runs at once:

{limited_batch_table}

{limited_batch_verdict}

{limited_left_out}

Made by `python benchmarks/peers.py --avx2`; {limited_conditions}."""
"""Of the page, where it has been measured."""
NOT_LIMITED = """### With vectors of AVX2

Not measured yet: `python benchmarks/peers.py --avx2` writes what stands here."""

TEXT = """\
# What an accuracy costs

Written by `python benchmarks/accuracy_page.py` from what the benchmarks named below have measured;
do not edit. No figure here is typed in.

## If you have never chosen an integrator

The equations of motion say how speeds change from one instant to the next. A computer goes from
instant to instant in *steps*, and makes a small error in each. Shorter steps mean smaller errors,
and more work. A *stepper* (integrator) is the recipe for one step. A recipe of order 4 makes errors
2^4 = 16 times smaller with half the step, one of order 8 makes them 2^8 = 256 times smaller; its
single step costs more. Which one is cheaper depends on how small the error has to be, so it is
measured:

![Error against CPU time, for every stepper and for other people's integrators](accuracy-cost.png)

Each line is one method, each point a setting: from top to bottom the error gets smaller, from left
to right the work gets more. **Down and left is better.** The vertical line is real time on one
core: what lies right of it cannot keep up with a running drive. Errors are the largest over the
whole run, of the balls' angles [rad] and of the whirl [in units of the eccentricity e], looked at
where a step ends, at most every {reference_period:g} ms; those of other people's integrators every
{period:g} ms. The grey band is where the reference itself is not known any better. Solid lines are
the steppers of ab_sim, dashed ones are other integrators solving the same equations.

How much accuracy do you need? A ball that is placed to 1e-3 rad is off by a thousandth of a race
radius, less than races are round. Comparing two designs wants 1e-6. Ten digits serve for finding
out whether a difference between two programs is a mistake. The whirl error in units of e is usually
{whirl_least:.0f} to {whirl_most:.0f} times the angle error, so say which one you mean.

You need not choose: write what you want into the scene, instead of a solver,

    accuracy: {{angle: 1.0e-6}}        # rad; or whirl: 1.0e-3, in units of e; or both

and the cheapest setting that is *measured* to deliver it on this scene is taken, with a safety
factor of {safety:g} on the error, and reported with its price by `ab-sim check`, `ab-sim run` and
the node. What double precision cannot give is refused with the best that can be had. What
measures it is ab_sim's own stepper at a shorter step, or at a smaller tolerance: that tells the
error of the integration, not a mistake in equations, laws or events, which the tests look for with
[a simulator that shares no line with ab_sim](../tests/reference). For your own scene,

    ab-sim accuracy my-scene.yaml --plot accuracy.png --json accuracy.json

draws the picture above.

## {accuracy_title}

{accuracy_table}

The reference: {reference}. Its uncertainty: {uncertainty_angle:.1e} rad, {uncertainty_whirl:.1e} e.
It is independent of the steppers here but for `collocation`, which has the same nodes and no line
of its code; it shares the equations of motion with them (DOP853 has `rk8`'s coefficients, in
SciPy's code).
There is such a reference for scenes without events only; with friction, contact or a motor
`ab-sim accuracy` compares ab_sim's own `rk8` and `tsit5` at short steps, which share its laws and
its location of events, and says so.

Made by `python benchmarks/accuracy_cost.py`; {accuracy_conditions}.

{left_out}

## Beside other integrators, at the same error

![Error against CPU time, ours and the strongest peers](peers.png)

All have output every {peers_period:g} ms and start anew at each kink of the speed profile; errors
are the largest over these outputs. Down and left is better; of batches, down and right. Who is
called how:

{called}

Each timed run comes just after another one of the same setting, so that its code is in the
processor's caches, as it is in a study. What a method takes at just an error is interpolated
between two of its settings, repeat by repeat; one whose coarsest useful setting has less error
takes the time of that, and so does rk8, whose steps have to divide the output's period. "Times
ours" is beside the quickest of ours as users run it. Compiling is not counted. With it, the CPU
time to the end of the first run is, for
{first_runs}. Ours is [below](#time-per-step).

{peers_table}

{peers_verdict}

{loop_verdict}

Eight runs at once:

{peers_batch_table}

{peers_batch_verdict}

The same drive with one thing changed, beside heyoka and SUNDIALS in C [CPU us per simulated s]:

{peers_cases}

The reference: {peers_reference}; where drag is stiff at a shorter step.
What it may be wrong by is what the two differ by: {peers_known}.
Its nodes are those of `collocation`, of whose code it has no line; DOP853 has neither. An error
below what is known is not judged.

{peers_left_out}

Made by `python benchmarks/peers.py`; {peers_conditions}.

{limited}

### Where the time goes

Runs of `collocation` on the drive above, by what is done in them. Counted by kernels that count,
timed with the package's own, output every {peers_period:g} ms:

{span_table}

Fitted to these runs and to others with spans of fixed lengths: {span_each}.

{span_heyoka}

{span_reason}

Eight runs at once, in us for a run of {span_seconds:g} s, where what differs is the balls' mass,
and with it the tables of the responses of deck and drag:

{span_batch}

heyoka fills the lanes of its vectors with eight runs. With `collocation` they are filled with eight
nodes of one run already: the runs of a batch follow one another, each with tables of its own. `rk8`
has eight runs in its lanes; what that gives is [below](#many-runs-at-once).

Made by `python benchmarks/collocation_step_cost.py`; {span_conditions}.

## Collocation beside rk8, effect by effect

The drive above with one thing changed each, or another scene, and decks in space: for each step
of `rk8` the cheapest setting of `collocation` that errs no more. Errors are the largest in a
ball's angle over the run [rad], every 20 ms, beside `rk8` at a much shorter step; where they are
below what that is known to, it says "at most". Tolerances of 1e-7, 1e-9, 1e-11 and
1e-13 were tried.

{collocation_table}

Between events `collocation` goes over friction and contact as it goes over all else. Each event
is `rk8`'s, in parts of a step that are fit for the tolerance, and behind it spans begin anew,
short ones first: that costs several times what `rk8` alone takes for an event. `thesis-hold` as
shipped has none of them in its first half, and one every 30 ms at its end.

{random_count} smooth scenes of both plants at random, three tolerances each, samples every 5 ms:
the largest error in a second is at most {random_off:.1f} times the tolerance and what a start
that is off grows by itself (`ab_sim`'s own `rk8` at 0.05 ms is what it is measured by); `rk8`
takes at least {random_least:.1f} times as long for no larger an error.

Live, what a wake-up takes that follows a new command and advances by four samples of 1 ms [us of
the clock; the drive alone, without topics]:

{collocation_live}

Made by `python benchmarks/collocation.py`; {collocation_conditions}. At random, by `python
benchmarks/collocation_at_random.py`; {random_conditions}.

## Time per step

![Time per step over the number of balls](step-cost.png)

{step_table}

What one more ball costs, from one number of balls to the next: {growth}. The C kernel
([thesis.c](../benchmarks/c_kernel/thesis.c), {compiler}) is the same scene written by hand, for a
number of balls and a method known when it is compiled.

From a scene to its first step, in a new process, which makes its machine code: {start}. Made by
`python benchmarks/step_cost.py`; {step_conditions}.

## Many runs at once

![Simulated seconds per CPU second](batch-throughput.png)

`ab_sim.batch.simulate_batch(scene, variations)` runs eight variations of a scene side by side,
with vector instructions; with `collocation`, whose vector instructions are for eight instants of
one run, one after the other. Measured with {batch_runs} runs. "One by one" is the compiled loop of
one run, "kernel" those of the batch; "whole call" contains the checks of every scene, of its
stability limits and the making of trajectories.

{batch_table}

{batch_verdict}
What limits the loop of runs side by side is arithmetic: two groups of eight in turns, so that one
computes while the other waits, gained nothing, and sixteen in wider vectors lost. Runs one after
the other make the tables of `collocation` anew where what they vary calls for it.

Made by `python benchmarks/batch_throughput.py`; {batch_conditions}.
"""


def accuracy_part(report: dict[str, Any]) -> dict[str, Any]:
    """The work-precision study."""
    rows, ratios = [], []
    for row in sorted(
        (row for row in report["rows"] if row["errors"]), key=lambda row: row["cpu"]["median"]
    ):
        errors = row["errors"]
        if not row["peer"] and not errors["angle"]["at_most"]:
            ratios.append(errors["whirl"]["value"] / errors["angle"]["value"])
        setting = f"{1e3 * row['step']:g} ms" if row["step"] else f"rtol {row['tolerance']:.0e}"
        energy = errors["energy"]
        rows.append([
            row["method"],
            setting,
            error(errors["angle"]),
            error(errors["whirl"]),
            error(errors["angle_end"]),
            "-" if energy is None else f"{energy:.0e}",
            f"{1e3 * row['cpu']['median']:.3g}",
        ])  # fmt: skip
    head = ["method", "setting", "angle [rad]", "whirl [e]", "angle at the end", "energy",
            "CPU ms per simulated s"]  # fmt: skip
    return {
        "accuracy_title": f"`{report['scene']}` without rolling friction, cheapest first",
        "accuracy_table": table(head, rows),
        "period": 1e3 * report["period"],
        "reference_period": 1e3 * report["reference_period"],
        "whirl_least": min(ratios),
        "whirl_most": max(ratios),
        "reference": report["reference"],
        "uncertainty_angle": report["uncertainty"]["angle"],
        "uncertainty_whirl": report["uncertainty"]["whirl"],
        "left_out": left_out_list(report["left_out"]),
        "accuracy_conditions": conditions(report),
    }


def step_part(report: dict[str, Any]) -> dict[str, Any]:
    """Time per step."""
    rows = []
    for row in report["rows"]:
        beside = ["", ""]
        if "ratio_to_c" in row:
            verdict = "" if row["within_goal"] else " **above the goal**"
            beside = [spread(row["c_ns_per_step"]), spread(row["ratio_to_c"]) + verdict]
        rows.append([row["method"], str(row["balls"]), spread(row["ns_per_step"]), *beside])
    growth = "; ".join(
        f"{method} " + ", ".join(f"{value:.0f} ns from {what}" for what, value in found.items())
        for method, found in report["ns_per_further_ball"].items()
    )
    start = "; ".join(
        f"`{one['scene']}`{' with ' + ', '.join(one['changes']) if one['changes'] else ''} "
        f"{spread(one['seconds'], digits=2)} s"
        for one in report["start"]
    )
    goal = report["goal_ratio_to_c"]
    head = ["method", "balls", "ns per step", "C", f"ratio to C (goal: at most {goal:g})"]
    return {
        "step_table": table(head, rows),
        "growth": growth,
        "start": start,
        "compiler": report["c_compiler"],
        "step_conditions": conditions(report),
    }


def batch_part(report: dict[str, Any]) -> dict[str, Any]:
    """Runs in a batch."""
    rows, verdicts, goal = [], [], report["goal"]
    for row in report["rows"]:
        angle, at_end = row["error"]["angle"], row["error"]["angle_end"]
        tolerance = "" if row["tolerance"] is None else f", {row['tolerance']:g}"
        rows.append([
            f"{row['stepper']} {1e3 * row['step']:g} ms{tolerance}", f"{angle:.1e}",
            f"{at_end:.1e}", spread(row["one_by_one"]), spread(row["kernel"]),
            spread(row["ratio"]), spread(row["whole_call"]), spread(row["last_whole_call"]),
        ])  # fmt: skip
    for key, what in (("kernel", "in the kernel"), ("whole_call", "for the whole call")):
        fit = [row for row in report["rows"] if row["error"]["angle"] <= goal["error"]]
        if not fit:
            verdicts.append(f"no setting measured gives {goal['error']:g} rad over the run")
            break
        best = max(fit, key=lambda row: row[key]["median"])
        reached = best[key]["median"]
        verdicts.append(
            f"with an error of {goal['error']:g} rad over the whole run, {reached:,.0f} simulated "
            f"seconds per CPU second {what} (goal: {goal[key]:,.0f}, "
            f"{'met' if reached >= goal[key] else '**not met**'})"
        )
    head = ["stepper, step, tolerance", "angle error over the run [rad]", "at its end",
            "one by one", "kernel", "ratio", "whole call", "keeping the last step"]  # fmt: skip
    return {
        "batch_table": table(head, rows),
        "batch_verdict": sentence(verdicts),
        "batch_conditions": conditions(report),
        "batch_runs": report["runs"],
    }


def limited_text(path: Path) -> str:
    """The section on limited vectors."""
    if not path.exists():
        return NOT_LIMITED
    return LIMITED.format(**limited_part(json.loads(path.read_text(encoding="utf-8"))))


def main() -> None:
    """Read the reports and write the page."""
    parser = argparse.ArgumentParser(description="Write the page on accuracy.")
    parser.add_argument("--docs", type=Path, default=DOCS)
    docs = parser.parse_args().docs
    names = "accuracy-cost", "peers", "span-cost", "step-cost", "batch-throughput"
    names += "collocation", "collocation-at-random"
    accuracy, peers, spans, steps, batches, collocation, random = (
        json.loads((docs / f"{name}.json").read_text(encoding="utf-8")) for name in names
    )
    filled = {
        "safety": SAFETY,
        **accuracy_part(accuracy),
        **peers_part(peers),
        "limited": limited_text(docs / "peers-avx2.json"),
        **collocation_step_part(spans),
        **collocation_part(collocation, random),
        **step_part(steps),
        **batch_part(batches),
    }
    (docs / "accuracy.md").write_text(TEXT.format(**filled), encoding="utf-8")


if __name__ == "__main__":
    main()
