"""Measure the delay of the live web page behind the simulation.

    python benchmarks/page_lag.py [--scene balanced-start-up] [--size 1400x900] [--for 30]

Starts `ab-sim live --view web` and opens its page in Chromium (tools/install-browser), which
draws by software. Prints quantiles over time of the age of the newest data on the page, and the
time between two of its frames.
"""

import argparse
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from ab_sim.show.viewing.page import newest_times  # noqa: E402
from tests.viewing.browser import browser  # noqa: E402

RECORD = """() => {
    window._frames = [];
    const record = () => {
        window._frames.push([Date.now(), Array.from(window._handle?.viewer_state() ?? [])]);
        requestAnimationFrame(record);
    };
    record();
}"""


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scene", default="balanced-start-up", help="name or file")
    parser.add_argument("--size", default="1400x900", help="of the page [px]")
    parser.add_argument("--for", dest="duration", type=float, default=30.0, help="s of the run")
    parser.add_argument("--skip", type=float, default=5.0, help="s of the run not judged")
    parser.add_argument("--picture", type=Path, help="file for a picture of the page at the end")
    given = parser.parse_args()
    width, height = map(int, given.size.split("x"))
    command = [sys.executable, "-u", "-m", "ab_sim", "live", given.scene, "--view", "web"]
    command += ["--for", str(given.duration)]
    live = subprocess.Popen(
        command, stdout=subprocess.PIPE, stdin=subprocess.PIPE, text=True, start_new_session=True
    )
    assert live.stdout is not None
    address = next(line.split()[-1] for line in live.stdout if line.startswith("watch it at"))
    starts: list[float] = []  # wall-clock time at which simulated time was 0, seen late

    def read() -> None:
        assert live.stdout is not None
        for line in live.stdout:
            if " of " in line and "rad/s" in line:
                starts.append(time.time() - float(line.split()[0]))

    threading.Thread(target=read, daemon=True).start()
    try:
        with browser(width, height) as screen:
            screen.open(address)
            screen.evaluate(RECORD)
            while not starts or time.time() - starts[0] < given.duration:
                time.sleep(0.1)
            frames = screen.evaluate("window._frames")
            if given.picture:
                given.picture.write_bytes(screen.png())
    finally:
        live.send_signal(signal.SIGINT)
        live.wait(60.0)
    start = min(starts)
    wall = 1e-3 * np.array([at for at, _ in frames])
    newest = [max(newest_times(bytes(state)).values(), default=0.0) for _, state in frames]
    grid = np.arange(start + given.skip, start + given.duration, 0.02)
    age = grid - start - np.array(newest)[np.searchsorted(wall, grid, side="right") - 1]
    between = np.diff(wall[(wall > grid[0]) & (wall < grid[-1])])
    print(f"page of {given.size}, load {os.getloadavg()[0]:.1f}; 5, 50, 95 and 100 % of the time:")
    for name, values in (("data older than", age), ("frames longer than", between)):
        quantiles = np.percentile(values, (5, 50, 95, 100))
        print(f"    {name} {', '.join(f'{value:.2f}' for value in quantiles)} s")


if __name__ == "__main__":
    main()
