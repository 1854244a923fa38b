"""Server of the web viewer's page, restricted to connections to the viewer.

Rerun's page, as Rerun serves it, reports its use to Rerun, and fetches versions from GitHub and
fonts from Google. A server can forbid all that to the browser, so this server relays Rerun's.

The server also adds a script to the page, which reports when the viewer in the browser has data,
and how much. Recorders then send hardly more than the page shows. A browser that draws by software
takes a third of a second for a frame, more on a busy machine, and the viewer takes only a few
messages with each frame. The script also keeps frames from queueing for the GPU
(`benchmarks/page_lag.py`).

The server answers only requests whose Host header names this machine. Otherwise another web site
could let its own name resolve to 127.0.0.1 (DNS rebinding), and its scripts could read the content.
Rerun's two servers do not check that header; their ports are chosen at random for each viewer.
"""

import contextlib
import http.client
import io
import ipaddress
import math
import re
import shutil
import threading
import time
from collections.abc import Sequence
from http import HTTPStatus
from http.client import HTTPException
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import IO
from urllib.parse import urlsplit

from ab_sim.base.protobuf import fields_of

LOOPBACK = "127.0.0.1"
PATIENCE, _ANSWER = 30.0, 1.0
"""Time for Rerun to answer a browser, and to answer a check [s]."""
_PASSED_ON = ("Content-Type", "Content-Encoding", "Content-Length")
_REFUSED = "This page is for this machine only: open it as 127.0.0.1 or localhost"

_OPENED, _SEEN = "/opened", "/seen"
BATCH, UNWATCHED, LAGGING = 0.1, 2.0, 30.0
"""Time between two batches of a recording [s].

If the page keeps up, if no page is open, and if the page does not keep up.
"""
IN_TRANSIT = 3
"""Number of newest batches, of which a page that keeps up shows at least the oldest.

A page reports only with its next frame, so a batch does not wait for the report on the last one.
"""
_LARGEST_STATE = 1 << 20
"""Largest size of a report [bytes]."""
_LEFT = 20.0
"""Time without a report after which a page counts as closed [s]; longer than a slow frame."""
_SCRIPT = b"""<script>{
  // Begin a frame only when the GPU has drawn the last one, so that no old frames queue for it.
  const getContext = HTMLCanvasElement.prototype.getContext;
  let gl = null, drawn = null, frame = null, begin = true;
  HTMLCanvasElement.prototype.getContext = function (kind, ...options) {
    const context = getContext.call(this, kind, ...options);
    if (kind === "webgl2") gl = context;
    return context;
  };
  const nextFrame = window.requestAnimationFrame.bind(window);
  window.requestAnimationFrame = (callback) => nextFrame(function wait(time) {
    if (time !== frame) {
      frame = time;
      begin = !drawn || gl.getSyncParameter(drawn, gl.SYNC_STATUS) === gl.SIGNALED;
    }
    if (!begin) return nextFrame(wait);
    callback(time);
    if (gl) {
      if (drawn) gl.deleteSync(drawn);
      drawn = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
      gl.flush();
    }
  });
  const post = (path, body) => fetch(path, { method: "POST", body }).catch(() => {});
  (function report(frames) {
    const state = window._handle ? window._handle.viewer_state() : new Uint8Array();
    const started = String.fromCharCode(...state).includes("sim_time");
    if (started && frames) requestAnimationFrame(() => report(frames - 1));
    else if (started) {
      post("opened");
      (function seen(last, next) {
        const now = performance.now();
        if (now < next) return requestAnimationFrame(() => seen(last, next));
        const state = window._handle.viewer_state(), text = state.join();
        const changed = text !== last || now > next + 1000;
        if (changed) post("seen", state);
        requestAnimationFrame(() => seen(text, changed ? now + 50 : next));
      })("", 0);
    } else setTimeout(() => report(frames), 100);
  })(3);
}</script>
</body>"""

_HOST = re.compile(r"(\[[0-9a-fA-F:.]+\]|[\w.-]+)(?::\d{1,5})?", re.ASCII)


def _is_loopback(host: str) -> bool:
    """Return whether a Host header, ``NAME`` or ``NAME:PORT``, names this machine.

    Any port is accepted, because a tunnel may have another port.
    """
    if (match := _HOST.fullmatch(host)) is None:
        return False
    try:
        return ipaddress.ip_address(match[1].strip("[]")).is_loopback
    except ValueError:
        return match[1].lower() == "localhost"


class Page:
    """Server of a web viewer's page on loopback, in separate threads.

    Parameters
    ----------
    port
        Port of the page.
    server
        Port of Rerun's own server on this machine, whose answers are relayed.
    proxy
        ``http://HOST:PORT`` of the viewer's proxy, the only address that the page may contact.
    """

    def __init__(self, port: int, server: int, proxy: str) -> None:
        page, self._rerun_port = self, server
        self.opened = 0
        """Number of browsers in which the viewer has started."""
        self._seen: dict[str, float] = {}
        self._last_report = -math.inf
        here = "'self' 'unsafe-inline' 'unsafe-eval' data: blob:"
        policy = f"default-src {here}; connect-src 'self' data: blob: {proxy}"

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                with contextlib.suppress(OSError, HTTPException):
                    if self._is_from_this_machine():
                        self._relay()

            def do_POST(self) -> None:
                with contextlib.suppress(OSError):
                    if not self._is_from_this_machine():
                        return
                    stated = self.headers.get("Content-Length", "")
                    size = int(stated) if stated.isdecimal() else 0
                    state = self.rfile.read(min(size, _LARGEST_STATE))
                    if self.path == _OPENED:
                        page.opened += 1
                    elif self.path == _SEEN:
                        page.take_report(state)
                    else:
                        self.send_error(HTTPStatus.NOT_FOUND)
                        return
                    self.send_response(HTTPStatus.NO_CONTENT)
                    self.end_headers()

            def _is_from_this_machine(self) -> bool:
                named = self.headers.get_all("Host", [])
                if len(named) == 1 and _is_loopback(named[0]):
                    return True
                self.send_error(HTTPStatus.MISDIRECTED_REQUEST, explain=_REFUSED)
                return False

            def _relay(self) -> None:
                connection = http.client.HTTPConnection(LOOPBACK, server, timeout=PATIENCE)
                with contextlib.closing(connection):
                    connection.request("GET", self.path)
                    answer = connection.getresponse()
                    headers = {name: answer.getheader(name) for name in _PASSED_ON}
                    content: IO[bytes] = answer
                    if urlsplit(self.path).path == "/":
                        html = answer.read().replace(b"</body>", _SCRIPT)
                        content, headers["Content-Length"] = io.BytesIO(html), str(len(html))
                    self.send_response(answer.status)
                    for name, value in headers.items():
                        if value:
                            self.send_header(name, value)
                    self.send_header("Content-Security-Policy", policy)
                    self.end_headers()
                    shutil.copyfileobj(content, self.wfile)

            def log_message(self, *_: object) -> None:
                pass

        self._server = ThreadingHTTPServer((LOOPBACK, port), Handler)
        self._server.daemon_threads = True
        self.port: int = self._server.server_address[1]
        self._thread = threading.Thread(target=self._server.serve_forever, name="page", daemon=True)
        self._thread.start()

    def take_report(self, state: bytes) -> None:
        """Store the newest time of each recording in a browser's report; see ``newest_times``."""
        # Ignore the state of another version of Rerun, which has another form.
        with contextlib.suppress(TypeError, ValueError):
            self._seen, self._last_report = newest_times(state), time.monotonic()

    def interval(self, recording: str, sent: Sequence[float]) -> float:
        """Return the time [s] from one batch of a recording to the next one.

        Parameters
        ----------
        recording
            Id of the recording.
        sent
            Newest time [s] in each of the last `IN_TRANSIT` or more batches, or in all of them if
            fewer were sent.
        """
        if time.monotonic() - self._last_report > _LEFT:
            return UNWATCHED
        last = self._seen.get(recording, -math.inf)
        keeps_up = len(sent) < IN_TRANSIT or last >= sent[-IN_TRANSIT]
        return BATCH if keeps_up else LAGGING

    def answers(self) -> bool:
        """Return whether Rerun's server answers requests for the page."""
        connection = http.client.HTTPConnection(LOOPBACK, self._rerun_port, timeout=_ANSWER)
        with contextlib.closing(connection), contextlib.suppress(OSError, HTTPException):
            connection.request("GET", "/")
            return connection.getresponse().status == HTTPStatus.OK
        return False

    def close(self) -> None:
        """Stop the server."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


_TIMELINE = b"sim_time"
"""Timeline whose newest times a page reports."""


def newest_times(state: bytes) -> dict[str, float]:
    """Return the newest time [s] that the viewer has of each recording, by the recording's id.

    Parameters
    ----------
    state
        ``GetStateResponse`` of Rerun's viewer control, in protobuf's wire format.

    Raises
    ------
    TypeError, ValueError
        The state has another form.
    """
    times = {}
    for recording in map(fields_of, fields_of(state).get(3, [])):
        name = b"".join(recording.get(1, [])).decode(errors="replace")
        for timeline in recording.get(2, []):
            if _TIMELINE in timeline:
                spans = map(fields_of, fields_of(timeline).get(3, []))
                ends = [end for span in spans for end in span.get(2, [])]
                times[name.rpartition(":")[2]] = 1e-9 * max(ends, default=0)
    return times
