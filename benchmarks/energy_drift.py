"""Energy drift of an undamped drive over a million revolutions, as JSON.

    python benchmarks/energy_drift.py [--revolutions 1000000] [--out benchmarks/energy_drift.json]

The thesis' drive at 200 rad/s without damping and drag, rk8 at 1 ms: the energy balance's residual
relative to the energy, at every tenth of the way.
"""

import argparse
import json
import math
import platform
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from ab_sim.drive import Drive  # noqa: E402
from ab_sim.scene import load_scene  # noqa: E402

CHANGES = [
    "effects.rolling_friction=",
    "effects.suspension.damping=0.0",
    "effects.viscous_drag.coefficient=0.0",
    "start={speed: 200.0, ball_angles: [0.3, -0.9]}",
    "profile=",
    "solver={stepper: rk8, step: 0.001}",
]


def main() -> None:
    """Run it and write it down."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--revolutions", type=int, default=1_000_000)
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(".json"))
    asked = parser.parse_args()
    drive = Drive(load_scene("thesis-hold", CHANGES), energy_balance=True)
    begin, rows = time.process_time(), []
    for tenth in range(1, 11):
        while drive.observe().psi < 2 * math.pi * asked.revolutions * tenth / 10:
            drive.advance(20_000)
        energy = drive.energy()
        residual = (energy.stored - energy.at_start - energy.motor_work) / energy.stored
        rows.append({"revolutions": drive.observe().psi / (2 * math.pi), "residual": residual})
        print(f"{rows[-1]['revolutions']:12.0f} revolutions: residual {residual:.3g}", flush=True)
    report = {
        "scene": "thesis-hold",
        "changes": CHANGES,
        "rows": rows,
        "cpu_seconds": time.process_time() - begin,
        "machine": platform.platform(),
        "python": platform.python_version(),
    }
    asked.out.write_text(json.dumps(report, indent=1) + "\n")


if __name__ == "__main__":
    main()
