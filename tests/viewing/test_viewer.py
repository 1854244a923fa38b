"""A viewer gets what a growing file has, whatever becomes of it; real processes of Rerun."""

import os
import signal
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.request import urlopen

import numpy as np
import pytest
from numpy.typing import NDArray
from rerun.chunk import RrdReader

from ab_sim.base.errors import InputError, RecordingError
from ab_sim.record.recording import Recording
from ab_sim.show.viewing import Viewer, check_view
from ab_sim.show.viewing.feed import Feed, Program
from ab_sim.show.viewing.proxy import Answer, Proxy, free_port
from tests.recorded import read_recording
from tests.recording.runs import describe, run
from tests.waiting import until

DEADLINE = 60.0
NAMES, SAMPLES = run(4000)


class Growing:
    """A recording that grows while a test looks on."""

    def __init__(self, path: Path) -> None:
        self.path, self.rows = path, 0
        self._recording = Recording(path, description=describe())

    def grow(self, rows: int = 100) -> None:
        self._recording.block(NAMES, SAMPLES[self.rows : self.rows + rows])
        self._recording.flush()
        self.rows += rows

    def close(self) -> None:
        self._recording.close()


class Onlooker:
    """Another client of a viewer, which keeps what it is shown in a file."""

    def __init__(self, url: str, path: Path) -> None:
        self._program, self._path = Program(), path
        port = str(free_port())
        arguments = ["--bind", "127.0.0.1", "--port", port, "--save", str(path), url]
        self._started = self._program.start(arguments, tied=True, screen=False)

    @property
    def seen(self) -> NDArray[np.float64]:
        try:
            return read_recording(self._path).samples
        except RecordingError:  # it is just being written
            return np.empty((0, len(NAMES)))

    @property
    def rows(self) -> list[int]:
        """Of each recording."""
        try:
            reader = RrdReader(self._path)
            stores = [reader.stream(store=store).to_chunks() for store in reader.recordings()]
        except (RuntimeError, ValueError):  # it is just being written
            return []
        angles = [[c for c in chunks if c.entity_path == "/samples"] for chunks in stores]
        return sorted(sum(c.num_rows for c in of_one if not c.is_static) for of_one in angles)

    def close(self) -> None:
        self._started.end(DEADLINE)
        self._program.close()


Watch = Callable[[str], Onlooker]


@pytest.fixture
def watch(tmp_path: Path) -> Iterator[Watch]:
    made: list[Onlooker] = []

    def watch(url: str) -> Onlooker:
        made.append(Onlooker(url, tmp_path / f"seen-{len(made)}.rrd"))
        return made[-1]

    yield watch
    for onlooker in made:
        onlooker.close()


@pytest.fixture
def web() -> Iterator[Viewer]:
    viewer = Viewer("web")
    yield viewer
    viewer.close()
    assert viewer.process is None


@pytest.fixture
def growing(tmp_path: Path) -> Iterator[Growing]:
    made = Growing(tmp_path / "run.rrd")
    made.grow()
    yield made
    made.close()


def all_there(onlooker: Onlooker, growing: Growing) -> bool:
    return onlooker.seen.tobytes() == SAMPLES[: growing.rows].tobytes()


def test_shows_what_is_recorded_bit_for_bit(web: Viewer, growing: Growing, watch: Watch) -> None:
    web.feed(growing.path)
    until(lambda: web.state == "showing", "it comes up")
    with urlopen(web.address) as page:
        assert b"Rerun" in page.read()
    onlooker = watch(web.proxy.url)
    for _ in range(5):
        growing.grow()
        until(lambda: all_there(onlooker, growing), "what grew came through")
    web.finish(growing.path)
    until(lambda: web.waiting == 0, "nothing waits")


def test_stopped_and_killed(web: Viewer, growing: Growing, watch: Watch) -> None:
    web.feed(growing.path)
    until(lambda: web.state == "showing", "it comes up")
    assert web.process is not None
    first = watch(web.proxy.url)
    until(lambda: all_there(first, growing), "it works")
    os.kill(web.process, signal.SIGSTOP)
    until(lambda: web.state.startswith("does not answer"), "it is seen to have stopped")
    assert web.trouble
    growing.grow()
    os.kill(web.process, signal.SIGCONT)
    until(lambda: web.state == "showing" and all_there(first, growing), "nothing is missing")
    address, killed = web.address, web.process
    os.kill(killed, signal.SIGKILL)
    until(lambda: web.restarts == 1 and web.state == "showing", "it is started again")
    growing.grow()
    second = watch(web.proxy.url)
    until(lambda: all_there(second, growing), "and shows all of what still grows")
    assert web.address == address and web.process != killed


def test_two_drives_in_one_that_runs_already(
    web: Viewer, growing: Growing, watch: Watch, tmp_path: Path
) -> None:
    until(lambda: web.state == "showing", "it comes up")
    other = Growing(tmp_path / "other.rrd")
    other.grow(300)
    guests = [Viewer(web.proxy.url) for _ in range(2)]
    for guest, drive in zip(guests, (growing, other), strict=True):
        assert guest.address == web.proxy.url
        guest.feed(drive.path)
    onlooker = watch(web.proxy.url)
    until(lambda: onlooker.rows == [growing.rows, other.rows], "both are there, each its own")
    other.close()
    for guest in guests:
        guest.close()
    assert web.process is not None, "whose it is not does not end it"
    assert web.proxy.check() is Answer.HERE


@pytest.mark.filterwarnings("error::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_file_that_is_gone_ends_its_feed(tmp_path: Path) -> None:
    program = Program()
    feed = Feed(tmp_path / "gone.rrd", "127.0.0.1", free_port(), program)
    until(lambda: feed.over, "its process ends")
    assert feed.waiting == 0
    feed.stop()
    program.close()


def test_only_linux_ties_a_process_to_its_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    """Other systems have no ``prctl``, so the program is started directly there."""
    program = Program()
    monkeypatch.setattr(sys, "platform", "darwin")
    begun = program.start(["--version"], tied=True, screen=False)
    assert begun.process.wait(DEADLINE) == 0
    assert sys.executable not in begun.process.args
    program.close()


def test_nobody_there_until_somebody_is(growing: Growing, watch: Watch) -> None:
    proxy = Proxy("127.0.0.1", free_port())
    viewer = Viewer(proxy.url)
    viewer.feed(growing.path)
    until(lambda: viewer.trouble, "it says so")
    assert viewer.state == f"there is no viewer at {proxy.url}" and not viewer.gone
    program = Program()
    serve = ["--serve-grpc", "--bind", proxy.host, "--port", str(proxy.port)]
    late = program.start(serve, tied=True, screen=False)
    try:
        until(lambda: viewer.state == "showing", "it is found")
        onlooker = watch(proxy.url)
        until(lambda: all_there(onlooker, growing), "and shown everything")
    finally:
        viewer.close()
        late.end(DEADLINE)
        program.close()


def test_who_answers_wrongly_or_hangs_up_is_no_viewer() -> None:
    with socket.create_server(("127.0.0.1", 0)) as stranger:
        proxy = Proxy("127.0.0.1", stranger.getsockname()[1])
        assert proxy.check() is Answer.SILENT

        def hang_up() -> None:
            for _ in range(2):
                stranger.accept()[0].close()

        thread = threading.Thread(target=hang_up)
        thread.start()
        assert proxy.check() is Answer.NOBODY
        thread.join()


def test_no_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(InputError, match="native: .*no screen"):
        check_view("native", screen=True)
    viewer = Viewer("native")
    until(lambda: viewer.gone, "it gives up")
    assert viewer.trouble and "could not start: there is no screen" in viewer.state
    viewer.close()


@pytest.mark.parametrize(
    "view",
    ["", "screen", "rerun+http://127.0.0.1/proxy", "rerun+http://127.0.0.1:x/proxy",
     "http://127.0.0.1:9876/proxy", "rerun+http://127.0.0.1:99999/proxy",
     "rerun+http://no.such.host.invalid:9876/proxy"],
)  # fmt: skip
def test_what_no_viewer_can_be_made_of(view: str) -> None:
    with pytest.raises(InputError, match="must be web, native"):
        check_view(view)


def test_a_port_that_is_taken() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(InputError, match=f"port {port}: .*in use"):
            Viewer("web", port)
