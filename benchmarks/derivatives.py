"""Exact derivatives of runs beside differences of runs: drives at random, with their events.

    python benchmarks/derivatives.py [--out docs] [--scenes 100]

writes derivatives.json: for each drive its events and, by key, the largest error of any channel at
any sample, as a share of the channel's largest derivative, by the differences of fourth order that
agree best of five; why a run was refused; and CPU time of a run with its derivatives beside that of
two runs for each key, which central differences take.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import arguments  # noqa: E402

from ab_sim.analysis.sensitivity import NoDerivative, Sensitivities, sensitivities  # noqa: E402
from ab_sim.cli.outputs import write_json  # noqa: E402
from ab_sim.drive import Drive  # noqa: E402
from ab_sim.scene.load import load_scene  # noqa: E402
from ab_sim.scene.model import Scene  # noqa: E402
from ab_sim.studies.effect_cost import conditions  # noqa: E402
from tests.analysis.sensitivity.differences import worst_of_keys  # noqa: E402

SHARES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5)
KEYS = ["balls.mass", "start.ball_angles.0"]
At = Callable[[float, float], float]
"""A number at random, evenly between two."""


def of_rows(at: At) -> tuple[str, list[str], list[str]]:
    """Two to five unequal balls that collide, and form rows."""
    n = round(at(1.51, 5.49))
    free = np.array([at(0.0, 1.0) for _ in range(n)])
    angles = np.cumsum(0.25 + free / free.sum() * (2.0 * np.pi - 0.25 * n)) - np.pi
    masses = [at(2e-4, 6e-4) for _ in range(n)]
    changes = [f"balls.count={n}", f"balls.mass={masses}", f"start.ball_angles={angles.tolist()}"]
    changes += [f"effects.ball_contact.restitution_coefficient={at(0.0, 0.9)}"]
    changes += [f"effects.rolling_friction.arm={10 ** at(-6.0, -4.5)}", "duration=0.4"]
    bounce = "effects.ball_contact.restitution_coefficient"
    keys = ["balls.mass.0", "start.ball_angles.1", bounce, "race.radius"]
    return "packed-balls", [*changes, f"start.speed={at(0.0, 90.0)}"], keys


def of_weight(at: At) -> tuple[str, list[str], list[str]]:
    """On edge: balls that swing, stick, lose their load, and meet."""
    first = at(-0.8, 0.8)
    changes = [f"start.ball_angles=[{first}, {first + at(0.25, 1.0)}]", "duration=0.6"]
    changes += [f"effects.ball_contact.restitution_coefficient={at(0.0, 0.9)}"]
    changes += [f"effects.rolling_friction.arm={10 ** at(-6.0, -4.0)}"]
    keys = [*KEYS, "effects.rolling_friction.arm", "effects.gravity.direction"]
    return "on-edge", [*changes, f"start.speed={at(0.0, 12.0)}"], keys


def of_start_up(at: At) -> tuple[str, list[str], list[str]]:
    """A start-up with a hold, and friction."""
    changes = [f"start.ball_angles=[{at(-3.0, 3.0)}, {at(-3.0, 3.0)}]", "duration=0.8"]
    changes += [f"effects.rolling_friction.arm={10 ** at(-5.5, -4.0)}"]
    changes += [f"effects.viscous_drag.coefficient={at(0.05, 1.0)}"]
    keys = [*KEYS, "effects.rolling_friction.arm", "profile.acceleration"]
    return "thesis-hold", [*changes, f"start.speed={at(40.0, 110.0)}"], keys


def of_all(at: At) -> tuple[str, list[str], list[str]]:
    """All effects, a motor at its limit among them."""
    first = at(-1.0, 1.0)
    changes = [f"start.ball_angles=[{first}, {first + at(0.3, 1.0)}]", "duration=0.6"]
    changes += [f"effects.race_friction.coefficient={10 ** at(-3.5, -1.5)}"]
    changes += [f"effects.motor.torque_limit={10 ** at(-3.5, -2.0)}"]
    keys = [*KEYS, "effects.race_friction.coefficient", "effects.motor.torque_limit"]
    return "everything", [*changes, f"start.speed={at(0.0, 40.0)}"], keys


def of_space(at: At) -> tuple[str, list[str], list[str]]:
    """A deck in space, tilted."""
    angles = [at(-3.0, 3.0) for _ in range(4)]
    changes = [f"start.ball_angles={angles}", f"effects.gravity={{tilt: {at(0.0, 1.5)}}}"]
    changes += ["duration=0.2", f"start.speed={at(50.0, 300.0)}"]
    keys = ["balls.mass", "rotor.inertia.4", "mounts.1.stiffness", "effects.gravity.tilt"]
    return "couple-unbalance", changes, keys


KINDS = (of_rows, of_weight, of_start_up, of_all, of_space)


def cpu(work: Callable[[], object], repeats: int) -> float:
    """Of the quickest of some [s]."""
    times = []
    for _ in range(repeats):
        begin = time.process_time()
        work()
        times.append(time.process_time() - begin)
    return min(times)


def measure(seed: int, repeats: int) -> dict[str, Any]:
    """One drive."""
    random, kind = np.random.default_rng(seed), KINDS[seed % len(KINDS)]
    name, changes, keys = kind(lambda low, high: float(random.uniform(low, high)))
    scene = load_scene(name, changes)
    row: dict[str, Any] = {"seed": seed, "kind": kind.__name__, "scene": name}
    try:
        found: Sensitivities = sensitivities(scene, keys)
    except NoDerivative as error:
        return {**row, "refused": str(error)}

    def runs(of: Scene) -> None:
        for _ in range(2 * len(keys)):
            Drive(of).advance(len(found.trajectory) - 1)

    drive = Drive(found.scene)
    drive.advance(len(found.trajectory) - 1)
    row |= {"events": drive.events, "error": worst_of_keys(found, SHARES)}
    own = cpu(lambda: sensitivities(scene, keys), repeats)
    return {**row, "cpu": own, "cpu_of_differences": cpu(lambda: runs(found.scene), repeats)}


def main() -> None:
    """Measure and write the file."""
    parser = arguments("Exact derivatives beside differences of runs.", 3)
    parser.add_argument("--scenes", type=int, default=100)
    asked, rows = parser.parse_args(), []
    for seed in range(asked.scenes):
        rows.append(measure(seed, asked.repeats))
        print(rows[-1])
    errors = [max(row["error"].values()) for row in rows if "error" in row]
    report = {
        **conditions(),
        "drives": len(rows),
        "refused": len(rows) - len(errors),
        "events": sum(row.get("events", 0) for row in rows),
        "median_error": float(np.median(errors)),
        "largest_error": float(np.max(errors)),
        "rows": rows,
    }
    write_json(report, str(asked.out / "derivatives.json"))


if __name__ == "__main__":
    main()
