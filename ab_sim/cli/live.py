"""Live runs in one terminal, with an optional viewer: `ab-sim live` and `ab-sim demo`."""

import contextlib
import importlib
import math
import os
import select
import shlex
import shutil
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from rich.progress import BarColumn, Progress, TextColumn
from rich.text import Text

from ab_sim.base.errors import InputError, Interrupted
from ab_sim.base.files import RECORDING, check_can_be_made, check_ending, check_writable
from ab_sim.base.presentation import in_one_turn
from ab_sim.cli.checks import require_ros
from ab_sim.cli.outputs import own_command, results
from ab_sim.cli.scene_commands import DemoOptions, LiveOptions
from ab_sim.drive.overlap import together_at_start
from ab_sim.scene import Scene, load_scene
from ab_sim.show.viewing import SHOWING, WEB, check_view, screens

if TYPE_CHECKING:
    from ab_sim.cli.live_run import LiveRun

NOWHERE = "none"
"""Value of ``--view`` without a viewer."""
Show = Callable[["LiveRun"], None]
"""Function that shows the present state of a run."""
GLANCE = 0.1
"""Time between two checks for a page or for Enter [s]."""


def _check_view_option(view: str) -> None:
    """Refuse a ``--view`` whose viewer is not available.

    Raises
    ------
    InputError
        The viewer is not available; the message lists the allowed ones.
    """
    if view == NOWHERE:
        return
    try:
        check_view(view, screen=True)
    except InputError as error:
        raise InputError(f"--view {error}; or {NOWHERE}") from error


def _recorder_parameters(record: Path | None, view: str) -> dict[str, str] | None:
    """Return the recorder's parameters; None: no recorder is needed."""
    if record is None and view == NOWHERE:
        return None
    return {"view": view} if record is None else {"path": str(record), "view": view}


def _start_run(live: "LiveRun", view: str, now: bool) -> None:
    """Print the viewer's address, or why there is none, and start the run.

    With a web page, wait for a browser first, except if ``now`` is set.
    """
    recorder = live.health("recorder")
    if "viewer" in recorder:
        state = recorder["viewer state"]
        is_shown = state == SHOWING
        words = f"watch it at {recorder['viewer']}" if is_shown else f"cannot be watched: {state}"
        results.print(words, soft_wrap=True)
    if view == WEB and not now:
        _wait_for_page(live)
    live.start()


def _wait_for_page(live: "LiveRun") -> None:
    """Wait until a browser shows the page, or until Enter.

    Raises
    ------
    Interrupted
        Ctrl-C was pressed; the empty recording is removed.
    """
    results.print("the run starts when the page is open, or with Enter   (Ctrl-C ends it)")
    try:
        while live.health("recorder").get("pages opened", "0") == "0" and not _enter_pressed():
            live.spin(GLANCE)
    except Interrupted:
        file = Path(live.health("recorder")["file"])
        live.stop()
        file.unlink(missing_ok=True)
        raise


def _serve_page(live: "LiveRun") -> None:
    """Serve the page with the whole run until Ctrl-C."""
    results.print("the run is over; the page shows all of it until Ctrl-C", soft_wrap=True)
    try:
        while True:
            live.spin(1.0)
    except Interrupted:
        pass


def _replay_hint(file: Path, view: str) -> str:
    """Return a hint that contains the command to show a recording again."""
    web = ["--web"] if view == WEB or not screens() else []
    return f"(look at it: {own_command()} {shlex.join(['view', str(file), *web])})"


def _enter_pressed() -> bool:
    """Return whether Enter was pressed; the end of standard input does not count."""
    try:
        descriptor = sys.stdin.fileno()
        # A background job that reads from its terminal would be stopped.
        if sys.stdin.isatty() and os.tcgetpgrp(descriptor) != os.getpgrp():
            return False
        return bool(select.select([descriptor], [], [], 0.0)[0] and os.read(descriptor, 4096))
    except (AttributeError, OSError, ValueError):  # no standard input, or closed
        return False


def _follow_run(live: "LiveRun", scene: Scene, duration: float) -> None:
    """Show a run in the terminal until it has lasted for a duration, in simulated time [s].

    Raises
    ------
    AbSimError
        A node failed.
    Interrupted
        The run was interrupted.
    """
    with _display(scene, duration) as show:
        while live.elapsed < duration:
            live.spin(0.1)
            show(live)


@contextlib.contextmanager
def _display(scene: Scene, duration: float) -> Iterator[Show]:
    """Show a bar with the drive's state; without a terminal, print a line per simulated second.

    Each new state of the profile controller is also printed, with its reason.
    """

    def state(live: "LiveRun") -> str:
        unit = scene.rotor.eccentricity
        whirl = f"W/e {live.whirl / unit:5.1f}" if unit else f"W {1e3 * live.whirl:6.3f} mm"
        balls = [f"{math.degrees(in_one_turn(angle)):7.1f}" for angle in live.ball_angles[:4]]
        more = [] if len(live.ball_angles) <= len(balls) else ["..."]
        heading = ["balls", *balls, *more, "deg"] if balls else []
        return " ".join([f"{live.speed:6.1f} rad/s  ", f"{whirl}  ", *heading])

    count = [0]

    def tell(live: "LiveRun") -> None:
        for at, status in live.statuses[count[0] :]:
            results.print(f"{at:5.1f} s   {status}", soft_wrap=True)
        count[0] = len(live.statuses)

    if not results.is_terminal:
        printed = [-1]

        def show_line(live: "LiveRun") -> None:
            tell(live)
            if int(live.elapsed) != printed[0]:  # decreases after a reset
                printed[0] = int(live.elapsed)
                done = min(live.elapsed, duration)
                results.print(f"{done:5.1f} of {duration:g} s   {state(live)}")

        yield show_line
        return
    columns = (
        BarColumn(),
        TextColumn("{task.completed:5.2f} of {task.total:g} s"),
        TextColumn("{task.fields[state]}"),
    )
    with Progress(*columns, console=results) as bar:
        task = bar.add_task("", total=duration, state="")

        def show(live: "LiveRun") -> None:
            tell(live)
            bar.update(task, completed=min(live.elapsed, duration), state=state(live))

        yield show


_RECORDINGS = Path("recordings")
"""Folder for recordings of runs with a viewer but without ``--record``."""


def run_live(options: LiveOptions) -> None:
    """Run a scene live until its duration is over or Ctrl-C.

    Raises
    ------
    InputError
        ROS 2 is missing, an argument is invalid, or another drive is running.
    AbSimError
        A node failed; the message has its last output.
    """
    view, record = options.view, options.record
    _check_view_option(view)
    scene = load_scene(options.scene, options.change)
    duration = scene.duration if options.seconds is None else options.seconds
    if not (math.isfinite(duration) and duration > 0.0):
        raise InputError(f"--for {duration:g}: must be above 0 s")
    if record is not None:
        check_ending(record, RECORDING, "--record")
        check_writable(record, "--record", replaced=False)
    elif view != NOWHERE:
        check_can_be_made(_RECORDINGS, "without --record, the folder")
    if together := together_at_start(scene):
        results.print(together, soft_wrap=True)
    require_ros("for a live run")
    from ab_sim.cli.live_run import LiveRun

    logs = Path(tempfile.mkdtemp(prefix="ab_sim-log-"))
    recorder = _recorder_parameters(record, view)
    results.print("starting the nodes ...")
    with LiveRun(scene, options.scene, options.change, recorder, logs) as live:
        live.wait_until_ready()
        _start_run(live, view, options.now)
        whole = False
        with contextlib.suppress(Interrupted):
            _follow_run(live, scene, duration)
            whole = True
        file = live.health("recorder").get("file", "")
        figures = live.stop_drive()
        results.print(", ".join(f"{label} {value}" for label, value in figures.items()))
        if file:
            results.print(f"wrote {file}   {_replay_hint(Path(file), view)}", soft_wrap=True)
        if view == WEB and whole:
            _serve_page(live)
        live.stop()
    shutil.rmtree(logs)  # kept for a run that failed


SCENE = "balanced-start-up"
"""Scene of the demo."""
REPORT = "ab_sim.cli.startup_report"
"""Module that reports on the demo, imported during the run."""


def run_demo(options: DemoOptions) -> None:
    """Run the demo, and write ``startup.rrd`` and ``startup.png`` into ``--out``.

    Raises
    ------
    InputError
        ROS 2 is missing, the folder cannot be written, or another drive is running.
    AbSimError
        A node failed; the message names its log.
    """
    out, view = options.out, options.view
    _check_view_option(view)
    require_ros("for a live run")
    from ab_sim.cli.live_run import LiveRun

    logs = out / "log"
    try:
        logs.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"--out {out}: {logs} cannot be created: {error.strerror}") from error
    recording, picture = out / "startup.rrd", out / "startup.png"
    for file in (recording, picture):
        check_writable(file, "--out")
        file.unlink(missing_ok=True)

    scene = load_scene(SCENE)
    name = Text(scene.name, "bold")
    results.print(Text.assemble("Start-up of ", name, f" in real time: {scene.description}"))
    results.print("starting three nodes ...")
    with LiveRun(scene, SCENE, (), _recorder_parameters(recording, view), logs) as live:
        live.wait_until_ready()
        results.print("three nodes are up: drive_sim, profile_controller, recorder")
        _start_run(live, view, options.now)
        # This import is slow; it happens while the run is in progress.
        reporting = threading.Thread(target=_import_report, daemon=True)
        reporting.start()
        _follow_run(live, scene, scene.duration)
        figures = live.stop_drive()
        if view != WEB:
            live.stop()
        reporting.join()
        hint = _replay_hint(recording, view)
        results.print("comparing with an offline run, and with a run without balls ...")
        importlib.import_module(REPORT).report_startup(scene, recording, picture, figures, hint)
        if view == WEB:
            _serve_page(live)
            live.stop()


def _import_report() -> None:
    """Import the report's module at low priority, while the run is in progress."""
    os.nice(10)  # affects only this thread on Linux: the nodes have priority
    importlib.import_module(REPORT)
