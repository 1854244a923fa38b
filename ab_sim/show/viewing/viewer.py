"""Viewer of growing recordings, and the thread that starts, feeds and monitors the viewer."""

import threading
import time
from collections.abc import Sequence
from pathlib import Path

from ab_sim.base.errors import InputError
from ab_sim.show.viewing.feed import Feed, Program, Started, screens
from ab_sim.show.viewing.page import BATCH, Page
from ab_sim.show.viewing.proxy import LOOPBACK, Answer, Proxy, free_port

WEB, NATIVE = "web", "native"
_NO_SCREEN = "there is no screen (neither DISPLAY nor WAYLAND_DISPLAY is set); web needs none"
MEMORY = "2GiB"
"""Memory limit of a viewer, and of a web server for it, above which Rerun drops old data."""
TURN = 0.25
"""Time between two checks of the viewer [s]."""
_STARTING = 30.0
"""Time for a viewer to start [s], on a busy machine with a slow disk."""
STARTED, SHOWING, CLOSED = "starting", "showing", "closed by its user"
"""Values of `Viewer.state`, in addition to texts on problems."""
SETTLED = 2.0
"""Uptime [s] from which on an exited viewer is restarted; an earlier exit would only recur."""
_ENDING = 2.0
"""Time for data in transit to arrive when a viewer is closed, and for the viewer to exit [s]."""


def check_view(view: str, screen: bool = False) -> None:
    """Refuse a text that does not name a viewer.

    Parameters
    ----------
    view
        Requested viewer, as in `Viewer`.
    screen
        Whether to refuse a window if there is no screen.

    Raises
    ------
    InputError
        The text is not allowed.
    """
    if screen and view == NATIVE and not screens():
        raise InputError(f"{view}: {_NO_SCREEN}")
    if view not in (WEB, NATIVE):
        try:
            Proxy.of(view)
        except InputError as error:
            raise InputError(f"{view!r}: must be {WEB}, {NATIVE}, or the address of a running "
                             f"viewer; {error}") from error  # fmt: skip


class Viewer:
    """Viewer that shows recordings as they grow, without delaying the caller.

    A viewer that is killed is started again at the same address, and shows the growing recordings
    again. A window that its user closes stays closed. A viewer that was started elsewhere gets its
    data as soon as it answers, also after an interruption.

    Parameters
    ----------
    view
        ``web``, served on loopback; ``native``, a window; or the address of a running viewer,
        ``rerun+http://HOST:PORT/proxy``.
    port
        Port of the web viewer's page; 0: any free port.
    memory
        Memory limit of the viewer, in Rerun's notation.

    Raises
    ------
    InputError
        The address is invalid, the port is taken, or Rerun's program is missing.
    """

    def __init__(self, view: str, port: int = 0, memory: str = MEMORY) -> None:
        check_view(view)
        self.restarts = 0
        self._native = view == NATIVE
        self._command: list[str] | None = None  # None: not started here
        if view in (WEB, NATIVE):
            self.proxy = Proxy(LOOPBACK, free_port())
            self._command = ["--bind", LOOPBACK, "--port", str(self.proxy.port)]
            self._command += ["--memory-limit", memory, "--server-memory-limit", memory]
        else:
            self.proxy = Proxy.of(view)
        self.address = self.proxy.url
        self._page: Page | None = None
        if view == WEB and self._command:
            server = free_port()
            self._command += ["--serve-web", "--web-viewer-port", str(server)]
            self._page = Page(free_port(port), server, f"http://{LOOPBACK}:{self.proxy.port}")
            self.address = self.proxy.page(self._page.port)
        self._program = Program()
        self._server: Started | None = None
        self._state, self._shown, self._gone = STARTED, False, False
        self._came_up = self._leave = False
        self._lock = threading.Lock()  # for the two collections of feeds
        self._files: dict[Path, Feed | None] = {}  # those that may grow
        self._last: list[Feed] = []  # of files that do not grow any more
        self._closing = threading.Event()
        self._began = time.monotonic()
        self._thread = threading.Thread(target=self._watch, name="viewer", daemon=True)
        self._thread.start()

    @property
    def state(self) -> str:
        """State: ``showing``, ``starting``, or the problem, as text."""
        return self._state

    @property
    def trouble(self) -> bool:
        """True if the viewer should show the recordings but does not."""
        return not self._shown and self._state not in (STARTED, CLOSED)

    @property
    def gone(self) -> bool:
        """True if the viewer has exited and will not be started again."""
        return self._gone

    @property
    def closed_by_user(self) -> bool:
        """True if the viewer's window was closed."""
        return self._state == CLOSED

    @property
    def waiting(self) -> int:
        """Number of recorded bytes that have not been sent to the viewer yet."""
        with self._lock:
            return sum(feed.waiting for feed in self._files.values() if feed)

    @property
    def pages_opened(self) -> int:
        """Number of browsers in which the page has started."""
        return 0 if self._page is None else self._page.opened

    def interval(self, recording: str, sent: Sequence[float]) -> float:
        """Return the time [s] from one batch of a recording to the next one.

        Parameters
        ----------
        recording
            Id of the recording.
        sent
            See `Page.interval`.
        """
        return BATCH if self._page is None else self._page.interval(recording, sent)

    @property
    def process(self) -> int | None:
        """Id of the viewer's process, if this process started it and it runs; else None."""
        server = self._server
        return server.process.pid if server and server.process.poll() is None else None

    def feed(self, path: Path) -> None:
        """Show a file, and follow the file as it grows."""
        with self._lock:
            self._files.setdefault(path, None)

    def finish(self, path: Path) -> None:
        """Show the rest of a file that does not grow any more, and stop following it."""
        with self._lock:
            if feed := self._files.pop(path, None):
                feed.finish()
                self._last.append(feed)

    def close(self, leave_window: bool = False) -> None:
        """Show the rest of all files, and stop the viewer if this process started it.

        Parameters
        ----------
        leave_window
            Whether a native viewer stays until its user closes it.
        """
        self._leave = leave_window and self._native
        self._closing.set()
        self._thread.join()
        self._program.close()
        if self._page is not None:
            self._page.close()

    def _watch(self) -> None:
        """Start, feed and check the viewer until `close`; then send the rest and stop it."""
        # Processes exit with the thread that starts them, so this thread starts and stops them.
        while not self._gone:
            self._check()
            if self._closing.wait(TURN):
                break
        for path in list(self._files):
            self.finish(path)
        end = time.monotonic() + (_ENDING if self._shown else 0.0)
        for feed in self._last:
            if not feed.wait(max(end - time.monotonic(), 0.0)):
                feed.stop()
        if self._server is not None and not self._leave:
            self._server.end(_ENDING)

    def _check(self) -> None:
        """Check once whether the viewer runs and answers; start, feed or report accordingly."""
        if self._command and (self._server is None or self._server.process.poll() is not None):
            self._start()
            return
        answer = self.proxy.check()
        if answer is Answer.HERE and (self._shown or self._page is None or self._page.answers()):
            self._shown = self._came_up = True
            self._state = SHOWING
            self._feed()
            return
        if answer is Answer.HERE:
            answer = Answer.SILENT  # the proxy starts before the page
        early = self._command and not self._came_up and time.monotonic() - self._began < _STARTING
        self._shown = False
        self._state = STARTED if early else f"{answer.value} at {self.address}"
        # A process that still feeds a viewer that is gone would wait for it, so stop it. A silent
        # viewer may only be slow.
        if answer is Answer.NOBODY:
            self._stop_feeds()

    def _start(self) -> None:
        """Start the viewer; start it again unless the user closed it or it failed at once."""
        assert self._command is not None
        if self._server is not None:
            self._stop_feeds()
            code, error = self._server.process.returncode, self._server.last_error
            if self._native and code == 0:
                self._give_up(CLOSED)
                return
            if time.monotonic() - self._began < SETTLED:
                self._give_up(f"could not start: {error or f'exit code {code}'}")
                return
            self.restarts += 1
        elif self._native and not screens():
            self._give_up(f"could not start: {_NO_SCREEN}")
            return
        self._shown, self._state, self._began = False, STARTED, time.monotonic()
        self._came_up = False
        try:
            self._server = self._program.start(
                self._command, tied=not self._native, screen=self._native
            )
        except OSError as reason:
            self._give_up(f"could not start: {reason}")

    def _give_up(self, state: str) -> None:
        """End with a state; the viewer is not started again."""
        self._shown, self._state, self._gone = False, state, True

    def _feed(self) -> None:
        """Start a process for each file that has none, or whose process has failed."""
        with self._lock:
            self._last = [feed for feed in self._last if not feed.over]
            for path, feed in self._files.items():
                if feed is not None and feed.broken:
                    feed.stop()
                    feed = None
                if feed is None:
                    self._files[path] = Feed(path, *self.proxy, self._program)

    def _stop_feeds(self) -> None:
        """Stop all processes; growing files are sent again from their beginning."""
        with self._lock:
            for feed in (*self._last, *self._files.values()):
                if feed is not None:
                    feed.stop()
            self._last.clear()
            self._files = dict.fromkeys(self._files)
