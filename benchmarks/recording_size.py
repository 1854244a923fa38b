"""Bytes per sample of a recording, for several ways to write it. Writes docs/recording-size.json.

    python benchmarks/recording_size.py [--seconds 60] [--out FILE.json]

A drive at 1 kHz with two balls, 15 channels. The part that does not grow with the recording (layout
and description) is reported separately: the additional size of the first second.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import rerun_cli

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from ab_sim.drive import Drive  # noqa: E402
from ab_sim.drive.description import describe  # noqa: E402
from ab_sim.record.recording import Recording  # noqa: E402
from ab_sim.scene import Scene, load_scene  # noqa: E402

SCENE = "thesis-hold"
WAYS = {
    "recorder, watched: batches of 0.1 s": (100, True),
    "recorder, nobody watches": (100, False),
    "recorder of a drive at 5 kHz, watched": (500, True),
    "offline: all at once": (5000, True),
}
"""Rows per batch, and whether each batch has pictures."""


def growth(
    path: Path,
    run: tuple[tuple[str, ...], np.ndarray],
    scene: Scene,
    rows: int,
    pictures: bool,
) -> tuple[float, int]:
    """Return the bytes that each sample adds, and the bytes that do not grow."""  # fmt: skip
    channels, samples = run
    begun, first = 0, 5000
    with Recording(path, description=describe(scene)) as recording:
        for start in range(0, len(samples), rows):
            recording.block(channels, samples[start : start + rows])
            recording.flush(pictures=pictures)
            if start + rows == first:
                begun = path.stat().st_size
        size = path.stat().st_size
    each = (size - begun) / (len(samples) - first)
    return each, round(path.stat().st_size - len(samples) * each)


def optimised(path: Path) -> int:
    """Return the size of the file after Rerun's optimisation."""
    out = path.with_suffix(".optimised.rrd")
    program = Path(rerun_cli.__file__).with_name("rerun")
    command = [program, "rrd", "optimize", "--profile", "live", path, "-o", out]
    subprocess.run(command, check=True, capture_output=True)
    return out.stat().st_size


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    docs = Path(__file__).resolve().parents[1] / "docs"
    parser.add_argument("--seconds", type=int, default=60, help="of the run; at least 10")
    parser.add_argument("--out", type=Path, default=docs / "recording-size.json")
    given = parser.parse_args()
    scene = load_scene(SCENE)
    made = Drive(scene).advance(1000 * given.seconds)
    run = made.channels, made.samples
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for number, (name, way) in enumerate(WAYS.items()):
            path = Path(folder, f"{number}.rrd")
            each, fixed = growth(path, run, scene, *way)
            whole = optimised(path) / len(made.samples)
            found[name] = {
                "bytes a sample": round(each, 1),
                "bytes beside": fixed,
                "bytes a sample after rerun rrd optimize, all in all": round(whole, 1),
            }
            print(f"{name:42} {each:6.1f} + {fixed / 1e3:5.0f} kB; optimised {whole:6.1f}")
    given.out.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
