"""Outcomes of start-ups of unknown drives: six strategies over random drives.

    python benchmarks/adaptive.py [--out docs] [--drives 1000] [--varied 200] [--repeats 5]

writes adaptive.json, adaptive.md, adaptive.png and adaptive-strategies.png; two processes take a
quarter of an hour. The controller runs in C, from examples/firmware_prototype, which tests keep
bit-identical to that in Python; the drives are those of the package. The seed is used nowhere else:
the numbers of ab_sim/control/chosen.py were found with drives of other seeds.
"""

import importlib.util
import itertools
import json
import math
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from adaptive_drives import (  # noqa: E402
    ACCELERATION,
    DURATION,
    FINAL,
    NOISE,
    PERIOD,
    SCENE,
    Course,
    Drawn,
    Outcome,
    Variation,
    drives,
    hold,
    led,
    readings,
    scene_of,
    settings_of,
    sweeps,
)
from adaptive_page import page  # noqa: E402
from adaptive_pictures import demo_picture, strategies_picture  # noqa: E402
from arguments import arguments  # noqa: E402

import ab_sim  # noqa: E402
from ab_sim.analysis.effect_cost import conditions  # noqa: E402
from ab_sim.analysis.startup import net_unbalance  # noqa: E402
from ab_sim.control import StartUp  # noqa: E402
from tests.control.in_c import InC, compiled  # noqa: E402

SEED = 3320262
MAIN = Variation("as drawn")
VARIATIONS = (
    Variation("acceleration instead of displacement", quantity="acceleration"),
    Variation("two axes", axes=2),
    Variation("noise density unknown to the controller", told=False),
    Variation("sensor with gain 3 (scale x 3)", gain=3.0),
    Variation("sensor with gain 1/3 (scale / 3)", gain=1.0 / 3.0),
    Variation("noise 3 %, controller assumes 1 %", noise=0.03),
    Variation("weak motor: 60 rad/s^2, controller assumes 200", weak=True),
    Variation("stiffness x 0.5", stiffness=0.5),
    Variation("stiffness x 1.6", stiffness=1.6),
)
HELD = (102.0, 0.5)
"""Hold of the scene: speed [rad/s] and time [s]."""
TUNED = (110.0, 4.0)
"""Hold tuned for the nominal drive, which the random drives vary: speed [rad/s], time [s]."""
HOLDS = list(itertools.product((94, 97, 100, 103, 106, 110, 115), (0.3, 0.7, 1.5, 3.0, 6.0)))
"""Holds [rad/s, s], of which the best for each drive is chosen afterwards."""


@cache
def library() -> Any:
    """Compile the controller in C; each process does so."""
    folder = tempfile.TemporaryDirectory()
    made = compiled(Path(folder.name), "double")
    return made, folder


@cache
def rule() -> Any:
    """Return the decision rule of the firmware prototype, which is no package."""
    path = ROOT / "examples" / "firmware_prototype" / "start_up.py"
    spec = importlib.util.spec_from_file_location("prototype_start_up", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["prototype_start_up"] = module
    spec.loader.exec_module(module)
    return module


def adaptive(drawn: Drawn, variation: Variation, seed: int) -> Outcome:
    """Run a drive under the controller."""
    course = Course(scene_of(drawn, variation))
    controller = InC(library()[0], "double", settings_of(course, variation))
    led(course, controller, variation, np.random.default_rng(seed))
    numbers = controller.state_numbers()
    return course.outcome(int(numbers[15]), ab_sim.control.State(int(numbers[0])).text)


class ByRule:
    """Rule of the firmware prototype with the interface of the controller."""

    def __init__(self) -> None:
        self.start_up = rule().StartUp(rule().Settings(), lambda text: None)

    def sample(self, time: float, angle: float, speed: float, x: float, y: float) -> None:
        """Pass a sample to the rule as two messages."""
        self.start_up.spindle(time, angle, speed)
        self.start_up.vibration(time, x, y)

    def command(self, time: float) -> float:
        """Return the command; the rule's clock counts periods."""
        return float(self.start_up.tick(PERIOD))


def by_rule(drawn: Drawn, variation: Variation, seed: int) -> Outcome:
    """Run a drive under the rule, which uses accelerations."""
    course = Course(scene_of(drawn, variation))
    listening = variation._replace(quantity="acceleration")
    led(course, ByRule(), listening, np.random.default_rng(seed))
    return course.outcome()


def best(outcomes: list[Outcome]) -> Outcome:
    """Return the outcome with the smallest whirl at the end."""
    return min(outcomes, key=lambda outcome: outcome.residual)


def run_drive(task: tuple[int, Drawn, int]) -> tuple[int, dict[str, Outcome]]:
    """Run all strategies on one drive; the first drives also get many holds and the variations."""
    index, drawn, varied = task
    scene, seed = scene_of(drawn, MAIN), SEED + 1 + index
    rows = {
        "no hold": hold(scene, 0.0, 0.0),
        "held": hold(scene, *HELD),
        "tuned": hold(scene, *TUNED),
        "rule": by_rule(drawn, MAIN, seed),
        "sweeps": best([sweeps(scene, count) for count in range(4)]),
        "adaptive": adaptive(drawn, MAIN, seed),
    }
    if index < varied:
        rows["best hold"] = best([hold(scene, *each) for each in HOLDS])
        for variation in VARIATIONS:
            rows[variation.name] = adaptive(drawn, variation, seed)
            if variation.weak or variation.stiffness != 1.0:
                plain = hold(scene_of(drawn, variation), 0.0, 0.0)
                rows[f"no hold; {variation.name}"] = plain
    return index, rows


def costs(repeats: int) -> dict[str, float]:
    """Measure the least CPU time of a sample and a command [us], in Python and in C."""
    found = {}
    for axes in (1, 2):
        course = Course(ab_sim.load_scene(SCENE))
        variation = Variation("", axes=axes)
        settings = settings_of(course, variation)
        course.to(FINAL)
        run = course.on(2.0)
        names = ("time", "angle", "speed")
        columns = [run[name].tolist() for name in names]
        draw = np.random.default_rng(1)
        rows = list(zip(*columns, *readings(course, run, variation, draw), strict=True))
        for _ in range(repeats):
            for name, controller in (
                ("Python", StartUp(settings)),
                ("C", InC(library()[0], "double", settings)),
            ):
                for part, took in _timed(controller, rows).items():
                    key = f"{name}, {axes} axis" if axes == 1 else f"{name}, {axes} axes"
                    key += f", {part}"
                    found[key] = min(found.get(key, math.inf), took)
    return found


def _timed(controller: Any, rows: list[Any]) -> dict[str, float]:
    command, sample = controller.command, controller.sample
    samples = commands = 0.0
    for first in range(0, len(rows), 5):
        start = time.process_time()
        command(rows[first][0])
        middle = time.process_time()
        for row in rows[first : first + 5]:
            sample(*row)
        commands, samples = commands + middle - start, samples + time.process_time() - middle
    return {"sample": 1e6 * samples / len(rows), "command": 5e6 * commands / len(rows)}


def demo() -> dict[str, Any]:
    """Run the demo's drive; return its readings, estimates and commands."""
    drawn = Drawn(1e-4, 1e3, 0.2, 0.22, 1e-5, (0.0, 2.0))
    course = Course(scene_of(drawn, MAIN))
    controller = StartUp(settings_of(course, MAIN))
    rows: list[list[float]] = []
    decisions: list[tuple[float, str]] = []

    def watch(run: Any) -> None:
        estimates, decision = controller.estimates, controller.decision
        if decision.number > len(decisions):
            decisions.append((course.drive.time, decision.text))
        rows.append(
            [
                course.drive.time,
                float(run["speed"][-1]),
                estimates.critical_speed,
                estimates.critical_speed_deviation,
                abs(estimates.net_unbalance),
                estimates.net_unbalance_deviation,
                float(net_unbalance(run.last(1), course.drive.scene)[0]),
                float(np.hypot(run["x"], run["y"]).max()),
                float(controller.state),
            ]
        )

    led(course, controller, MAIN, np.random.default_rng(1), watch)
    return {"rows": rows, "decisions": decisions, "outcome": course.outcome()._asdict()}


def report_of(count: int, varied: int, repeats: int, say: Callable[[str], None]) -> dict[str, Any]:
    """Return all contents of the page."""
    drawn = list(drives(SEED, count))
    found: list[dict[str, Outcome]] = [{} for _ in drawn]
    tasks = [(i, one, varied) for i, one in enumerate(drawn)]
    begun = time.monotonic()
    with ProcessPoolExecutor(2) as pool:
        for done, (index, rows) in enumerate(pool.map(run_drive, tasks, chunksize=2), 1):
            found[index] = rows
            if done % 20 == 0:
                took = time.monotonic() - begun
                left = took / done * (count - done)
                say(f"{done} of {count} drives, {took:.0f} s, {left:.0f} s to go")
    return {
        **conditions(),
        "seed": SEED,
        "drives": count,
        "varied": min(varied, count),
        "final_speed": FINAL,
        "acceleration": ACCELERATION,
        "duration": DURATION,
        "noise": NOISE,
        "period": PERIOD,
        "friction": [one.arm > 0.0 for one in drawn],
        "drawn": [list(one[:5]) + list(one.angles) for one in drawn],
        "outcomes": {
            name: [_plain(rows[name]) for rows in found if name in rows] for name in found[0]
        },
        "cpu": costs(repeats),
        "repeats": repeats,
        "clock": "CPU time of the process",
    }


def _plain(outcome: Outcome) -> list[Any]:
    """Return an outcome for JSON, which has no infinity."""
    return [None if value == math.inf else value for value in outcome]


def main() -> None:
    """Run the study and write all files."""
    parser = arguments(__doc__, 5)
    parser.add_argument("--drives", type=int, default=1000, help="random drives")
    parser.add_argument(
        "--varied", type=int, default=200, help="of which so many are varied, and held in 35 ways"
    )
    chosen = parser.parse_args()
    say = lambda text: print(text, file=sys.stderr, flush=True)  # noqa: E731
    report = report_of(chosen.drives, chosen.varied, chosen.repeats, say)
    shown = demo()
    strategies_picture(report, chosen.out / "adaptive-strategies.png")
    demo_picture(shown, chosen.out / "adaptive.png")
    (chosen.out / "adaptive.md").write_text(page(report), encoding="utf-8")
    (chosen.out / "adaptive.json").write_text(json.dumps(report) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
