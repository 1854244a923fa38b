"""Draw docs/live-view.png: the web viewer, in a real browser, of a running drive.

    python benchmarks/live_view_picture.py [--scene balanced-start-up] [--at 30] [--out FILE.png]

The picture is taken once the viewer has drawn the drive, after at least ``--at`` seconds of the
run. Needs Chromium (tools/install-browser). If it draws by software on a busy machine, this takes
minutes.
"""

import argparse
import signal
import subprocess
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.viewing.browser import browser  # noqa: E402
from tests.viewing.test_in_a_browser import drawn  # noqa: E402

SIZE = (1400, 900)


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    docs = Path(__file__).resolve().parents[1] / "docs"
    parser.add_argument("--scene", default="balanced-start-up", help="name or file")
    parser.add_argument("--at", type=float, default=30.0, help="s of the run")
    parser.add_argument("--out", type=Path, default=docs / "live-view.png")
    given = parser.parse_args()
    command = [sys.executable, "-u", "-m", "ab_sim", "live", given.scene, "--view", "web"]
    live = subprocess.Popen([*command, "--for", "3600"], stdout=subprocess.PIPE, text=True)
    assert live.stdout is not None
    try:
        address = next(line.split()[-1] for line in live.stdout if line.startswith("watch it at"))
        with browser(*SIZE) as screen:
            screen.open(address)
            began = time.monotonic()
            while not drawn(screen) or time.monotonic() - began < given.at:
                time.sleep(1.0)
            given.out.write_bytes(screen.png())
    finally:
        live.send_signal(signal.SIGINT)
        live.communicate()
    print(f"wrote {given.out}, {given.out.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
