"""The page of adaptive.json: docs/adaptive.md. Each of its figures is read or computed here."""

import math
from typing import Any

import numpy as np
from page_parts import conditions, table

from ab_sim.design.intervals import paired_shares, share_of

NAMES = {
    "no hold": "no hold",
    "held": "the demo's hold: 102 rad/s, 0.5 s",
    "tuned": "hold tuned for the nominal drive: 110 rad/s, 4 s",
    "rule": "the rule of `examples/firmware_prototype`",
    "sweeps": "up to three sweeps through resonance, the best kept",
    "adaptive": "**adaptive**",
    "best hold": "the best of 35 holds, known only afterwards",
}
LIMITS = (0.3, 0.15)
GOALS = {
    "all, below 0.3": (0.95, "at least"),
    "all, below 0.15": (0.85, "at least"),
    "friction, below 0.3": (0.92, "at least"),
    "friction, below 0.15": (0.75, "at least"),
    "t50 [s]": (9.0, "at most"),
    "t90 [s]": (16.0, "at most"),
    "peak W/e, 90 %": (35.0, "at most"),
}
COSTS = {"scale": 5.0, "noise 3": 3.0, "weak": 8.0, "stiffness": 8.0}
"""Points that a variation may cost, by a part of its name."""
HEAD = """# A start-up that finds its own way

Written by `python benchmarks/adaptive.py`; do not edit. No figure of the tables is typed in. How to
use it: [a start-up that finds its own way](howto/adaptive.md); in C for a microcontroller:
[examples/firmware_prototype](../examples/firmware_prototype/README.md).

Every other start-up knows the drive that it is for. This one is told the final speed, the largest
acceleration, and what its sensor reads. It finds the critical speed by itself and follows the *net
unbalance* q: the offset of the mass centre of rotor and balls.

![what it saw, believed and did on the demo's drive](adaptive.png)

## What it knows

A Kalman filter on x'' = -K x - D x' + Re[q (w^2 - i al) e^(i psi)], for each axis of the sensor,
with the spindle's measured angle and speed: state x, x', q, K, D and the sensor's offset, of which
all but x and x' are random walks ([axis_filter.py](../ab_sim/control/axis_filter.py)). For an
accelerometer the state holds K x: then a reading is linear in it. The square root of K is the
critical speed. The noise of a reading is found from what the filter did not expect.

How large |q| is in metres does not matter. It is compared with the largest that it has been once
the critical speed was known, the *scale*; so a sensor's gain does not matter either, nor a sign or
a turn that is common to all its axes.

## What it decides

1. **Run up** at the largest acceleration, until the critical speed is known to 2.5 % and the speed
   is a little above it.
2. **Dwell** there. At a ratio r of speed to critical speed the whirl is |q| r^2 / (r^2 - 1). As |q|
   falls it goes nearer, so that the whirl, which moves the balls against friction, stays large; not
   so near that the whirl's phase lags too far behind 180 degrees. When |q| rises, balls circulate:
   it goes away a little, and comes back slowly. When |q| stands still, friction holds balls: it
   goes nearer, for a larger whirl. It leaves when |q| is small, or has not fallen
   for a time, the longer the larger |q| is: two balls on opposite sides of the rotor stay there for
   seconds before they part.
3. **To the final speed**, at first by at most 0.9 (w - wn)^2 rad/s^2: that slow a change leaves no
   free whirl behind, which would take seconds to die away.
4. **Judge** there: balanced, or so far on the way that waiting is enough; otherwise
5. **Retry**: down to a little above the critical speed, never through it, and dwell again at
   another phase. It gives up after `most_retries` or `patience`, and stays at the final speed.

The numbers of all that are in [chosen.py](../ab_sim/control/chosen.py). They were found over other
random drives than those below.

## When something is wrong

It runs down, and says why, when samples stop for `silence`; when time goes back; when a reading is
beyond `limit`; when readings repeat (stuck, or cut off near their largest); when the offset drifts
away by more than the vibration; when two axes contradict each other on q (one has the wrong sign,
is turned, swapped or dead), twice: at first both filters begin anew, since one may have followed
wrongly a q that turned fast; when the angle does not go on as the speed says; when the spindle
does not follow. Numbers that are none, samples that come twice or too late are passed over. If it
knows too little to aim at a dwell, it goes to the final speed as a plain ramp does, and stays.

A slight saturation, which cuts off only the largest whirl, is not noticed, and may make it call a
drive balanced that is not.
"""
CHOICE = """## What to pick when

- **One drive that you know, the same each time:** a hold that `ab-sim tune` finds. It needs no
  sensor, and is over sooner.
- **Drives that differ, a vibration sensor and a processor:** the adaptive start-up. Its state
  takes 1.6 kB in double and half that in float; what a sample takes stands above.
- **No sensor:** no hold is the least that can go wrong with low friction; a hold that is long for
  the nominal drive shakes stiffer and softer ones.
- **Sweeps through resonance** need a sensor, too, and know less of it: each sweep throws the balls
  anew. US 7,814,507 describes such a thing for disc drives: whoever builds one should look whether
  it concerns them, and the same goes for any rule here; this page is no legal advice.
"""


def page(report: dict[str, Any]) -> str:
    """In Markdown."""
    parts = [HEAD, study(report), goals(report), variations(report), cpu(report), CHOICE]
    return "\n".join([*parts, f"## Conditions\n\n{conditions(report)}.\n"])


def figures(report: dict[str, Any], name: str) -> dict[str, float]:
    """What is reported of a strategy."""
    rows = report["outcomes"][name]
    friction = np.array(report["friction"][: len(rows)])
    residual = np.array([row[0] for row in rows])
    settled = np.array([math.inf if row[1] is None else row[1] for row in rows])
    found = {}
    for limit in LIMITS:
        found[f"all, below {limit}"] = share_of(residual < limit).value
    for limit in LIMITS:
        found[f"friction, below {limit}"] = share_of(residual[friction] < limit).value
    for part in (50, 90):
        found[f"t{part} [s]"] = _quantile(settled, part / 100.0)
    found["peak W/e, 90 %"] = _quantile(np.array([row[2] for row in rows]), 0.9)
    return found


def _quantile(values: np.ndarray, p: float) -> float:
    """Of values that may be infinite: a value of the sample."""
    return float(np.sort(values)[math.ceil(p * len(values)) - 1])


def _seconds(value: float) -> str:
    return f"{value:.1f}" if math.isfinite(value) else "never"


def study(report: dict[str, Any]) -> str:
    """The table of strategies."""
    rows, differences = [], []
    ours = np.array([row[0] for row in report["outcomes"]["adaptive"]])
    for name, shown in NAMES.items():
        found = figures(report, name)
        residual = np.array([row[0] for row in report["outcomes"][name]])
        shares = [share_of(residual < limit) for limit in LIMITS]
        texts = [f"{one.value:.3f} ({one.low:.3f} to {one.high:.3f})" for one in shares]
        friction = [found[f"friction, below {limit}"] for limit in LIMITS]
        rows.append(
            [
                shown,
                *texts,
                f"{friction[0]:.3f} / {friction[1]:.3f}",
                f"{_seconds(found['t50 [s]'])} / {_seconds(found['t90 [s]'])}",
                f"{found['peak W/e, 90 %']:.0f}",
            ]
        )
        if name != "adaptive":
            paired = [
                paired_shares(ours[: len(residual)] < limit, residual < limit) for limit in LIMITS
            ]
            differences.append(
                [shown, *(f"{p.difference:+.3f} ({p.low:+.3f} to {p.high:+.3f})" for p in paired)]
            )
    heads = ["strategy", "below 0.3", "below 0.15", "with friction", "t50 / t90 [s]", "peak W/e"]
    return f"""## The study

{report["drives"]} random drives, seed {report["seed"]}, all strategies on each, but for the best of
35 holds, which is found for the first {report["varied"]}: the rotor of
`balanced-start-up` with eccentricity and stiffness within 20 %, damping within 50 %, drag from 0.2
to 2 N s/m (uniform in its logarithm), balls that start anywhere; every other drive has rolling
friction, arm 0.5e-5 to 1.5e-5 m. Acceleration {report["acceleration"]:g} rad/s^2, final speed
{report["final_speed"]:g} rad/s, {report["duration"]:g} s. The controller hears the displacement
along one axis at 1 kHz with {report["noise"]:.0%} noise (of the whirl without balls at the final
speed).

The shares are of start-ups whose whirl in the last second is below 0.3 and 0.15 of the whirl
without balls, with 95 % intervals (Wilson); t50 and t90 are the times after which it stays below
0.3 in half and in 90 % of all; the peak is that of 90 %.

{table(heads, rows)}

![shares of the strategies](adaptive-strategies.png)

Of the sweeps, all of none to three are run for each drive and the best is taken, known only
afterwards: better than whoever does it can.

Adaptive less each other strategy, on the same drives, with 95 % intervals (Newcombe):

{table(["strategy", "below 0.3", "below 0.15"], differences)}
"""


def goals(report: dict[str, Any]) -> str:
    """What was asked for, and what came of it."""
    found = figures(report, "adaptive")
    rows = []
    for name, (goal, sense) in GOALS.items():
        value = found[name]
        met = value >= goal if sense == "at least" else value <= goal
        rows.append([name, f"{sense} {goal:g}", f"{value:.3g}", "yes" if met else "**missed**"])
    plain = figures(report, "no hold")
    worse = [name for name in list(GOALS)[:4] if found[name] < plain[name]]
    groups = "on none of these groups" if not worse else f"on {', '.join(worse)}"
    return (
        f"## Goals\n\n{table(['of adaptive', 'goal', 'found', 'met'], rows)}\n\n"
        f"Worse than no hold: {groups}.\n"
    )


def variations(report: dict[str, Any]) -> str:
    """What else costs."""
    count = report["varied"]
    ours = np.array([row[0] for row in report["outcomes"]["adaptive"][:count]])
    rows = []
    others = [
        name for name in report["outcomes"] if name not in NAMES and not name.startswith("no hold;")
    ]
    for name in others:
        found = figures(report, name)
        residual = np.array([row[0] for row in report["outcomes"][name]])
        paired = [paired_shares(residual < limit, ours < limit) for limit in LIMITS]
        most = next((value for part, value in COSTS.items() if part in name), None)
        verdict = ""
        if most is not None:
            costs = [-100.0 * one.difference for one in paired]
            ok = ["yes" if cost <= most else "**missed**" for cost in costs]
            verdict = f"{most:g}: {ok[0]} / {ok[1]}"
        plain = report["outcomes"].get(f"no hold; {name}")
        beside = ""
        if plain is not None:
            beside = " / ".join(
                f"{share_of(np.array([row[0] for row in plain]) < limit).value:.3f}"
                for limit in LIMITS
            )
        rows.append(
            [
                name,
                " / ".join(f"{found[f'all, below {limit}']:.3f}" for limit in LIMITS),
                " / ".join(f"{100.0 * one.difference:+.1f}" for one in paired),
                verdict,
                f"{_seconds(found['t50 [s]'])} / {_seconds(found['t90 [s]'])}",
                f"{found['peak W/e, 90 %']:.0f}",
                beside,
            ]
        )
    heads = ["variation", "below 0.3 / 0.15", "points", "allowed, met", "t50 / t90 [s]", "peak W/e"]
    return f"""## What it does not know

The first {count} of these drives again, with something else than the controller is told, or another
sensor; points are what the shares change by on the same drives.

{table([*heads, "no hold"], rows)}

Softer springs halve what drives the balls at the same ratio, and with it the pace; in 20 s not all
get there. Nearer dwells, longer ones, more patience and a larger whirl were tried: each gained some
points there, and lost as many, or time, on the other drives.
"""


def cpu(report: dict[str, Any]) -> str:
    """What it takes."""
    rows = [[name, f"{took:.2f}"] for name, took in report["cpu"].items()]
    return (
        "## What it takes\n\nCPU time of a sample at 1 kHz, and of a command each "
        f"{1e3 * report['period']:g} ms, the least of {report['repeats']} runs of 2,000 samples "
        "[us]. In C it is called from Python by ctypes, which takes most of that.\n\n"
        f"{table(['what', 'us'], rows)}\n"
    )
