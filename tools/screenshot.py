"""Take a picture of a recording in Rerun's viewer on a machine without a screen.

    .venv/bin/python tools/screenshot.py FILE.rrd PICTURE.png [TIME] [PAGE]

docs/view.png shows a run by `ab-sim run balanced-start-up --rrd FILE.rrd`, at 1.35 s.

TIME is in s, PAGE is one of the viewer's pages, counted from 0. Needs Mesa's software renderer
(Debian: mesa-vulkan-drivers).
"""

import os
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import rerun_cli
from PIL import Image
from rerun.experimental import ViewerClient

from ab_sim.record.recording import open_recording
from ab_sim.record.recording.blueprint import blueprint
from ab_sim.record.recording.drawing import Drawing

RENDERER = "/usr/share/vulkan/icd.d/lvp_icd.x86_64.json"
SIZE = "1400x900"


def main(file: str, picture: str, at: str = "0", page: str = "0") -> None:
    """Open a viewer, load the recording, move to a time and take the picture."""
    run = open_recording(file)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with tempfile.TemporaryDirectory() as folder:
        layout = Path(folder) / "page.rbl"
        drawing = Drawing.of(run.description)
        pages = blueprint(drawing, run.channels, list(run.notes.scalars), page=int(page))
        pages.save("ab_sim", str(layout))
        command = [str(Path(rerun_cli.__file__).parent / "rerun"), "--headless"]
        command += ["--bind", "127.0.0.1", "--port", str(port), "--window-size", SIZE]
        viewer = subprocess.Popen(
            [*command, file, str(layout)], env=os.environ | {"VK_ICD_FILENAMES": RENDERER}
        )
        try:
            time.sleep(8.0)  # the viewer does not report when it has loaded the recording
            client = ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
            client.set_time("sim_time", duration=float(at), play_state="paused")
            time.sleep(4.0)
            client.save_screenshot(picture)
            with Image.open(picture) as image:
                small = image.convert("RGB")
            small.save(picture, optimize=True)
        finally:
            viewer.terminate()
            viewer.wait()


if __name__ == "__main__":
    main(*sys.argv[1:])
