"""The page answers those who ask for this machine, and no names that others may choose."""

import http.client
import socket
from collections.abc import Iterator
from contextlib import closing, contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread

import pytest

from ab_sim.show.viewing.page import BATCH, LAGGING, UNWATCHED, Page
from tests.viewing.browser import browser
from tests.waiting import until

BEHIND = b"what Rerun serves"


@contextmanager
def page_before(content: bytes) -> Iterator[Page]:
    """A page before a server that has only that."""

    class Behind(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.send_header("Content-Length", str(len(content)))
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Behind) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        page = Page(0, server.server_address[1], "http://127.0.0.1:1")
        yield page
        page.close()
        server.shutdown()


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    with page_before(BEHIND) as page:
        yield page


def asked(page: Page, *hosts: str) -> tuple[int, bytes]:
    """Status and content for a request with these Host headers."""
    with closing(http.client.HTTPConnection("127.0.0.1", page.port, timeout=60.0)) as connection:
        connection.putrequest("GET", "/", skip_host=True)
        for host in hosts:
            connection.putheader("Host", host)
        connection.endheaders()
        answer = connection.getresponse()
        return answer.status, answer.read()


@pytest.mark.parametrize(
    "host", ["127.0.0.1", "localhost", "LocalHost", "[::1]", "127.1.2.3", "localhost:9090",
             "127.0.0.1:80", "[::1]:8080"]
)  # fmt: skip
def test_who_asks_for_this_machine_is_answered(page: Page, host: str) -> None:
    assert asked(page, host) == (200, BEHIND)


@pytest.mark.parametrize(
    "hosts",
    [
        ("evil.example",),
        ("evil.example:9090",),
        ("localhost.evil.example",),
        ("127.0.0.1.evil.example",),
        ("192.168.1.2",),
        ("0.0.0.0",),
        ("localhost@evil.example",),
        ("evil.example@localhost",),
        ("localhost/evil.example",),
        ("localhost:port",),
        ("localhost:",),
        ("2130706433",),
        ("",),
        (),
        ("localhost", "evil.example"),
    ],
)
def test_any_other_name_is_refused(page: Page, hosts: tuple[str, ...]) -> None:
    status, said = asked(page, *hosts)
    assert status == 421 and BEHIND not in said and b"127.0.0.1 or localhost" in said


def posted(page: Page, path: str, body: bytes = b"", host: str = "localhost") -> int:
    """Status for a report of the page's script."""
    with closing(http.client.HTTPConnection("127.0.0.1", page.port, timeout=60.0)) as connection:
        connection.request("POST", path, body, {"Host": host})
        return connection.getresponse().status


def field(number: int, value: bytes | int) -> bytes:
    """A field of a protobuf message."""
    if isinstance(value, int):
        return varint(number << 3) + varint(value)
    return varint(number << 3 | 2) + varint(len(value)) + value


def varint(value: int) -> bytes:
    return bytes([value & 0x7F | 0x80]) + varint(value >> 7) if value > 0x7F else bytes([value])


@pytest.mark.parametrize("stated", [None, b"", b"-1", b"1e3", b"\xb2"])
def test_a_report_without_a_length_is_answered(page: Page, stated: bytes | None) -> None:
    """Nothing is read then: a browser that waits for the answer sends nothing more."""
    before = page.opened
    length = b"" if stated is None else b"Content-Length: " + stated + b"\r\n"
    with socket.create_connection(("127.0.0.1", page.port), timeout=60.0) as connection:
        connection.sendall(b"POST /opened HTTP/1.1\r\nHost: localhost\r\n" + length + b"\r\n")
        assert b" 204 " in connection.recv(100)
    assert page.opened == before + 1


def test_a_batch_waits_for_a_page_that_is_behind(page: Page) -> None:
    assert page.interval("run", []) == UNWATCHED
    before = page.opened
    assert posted(page, "/opened") == 204 and page.opened == before + 1
    span = field(2, field(1, b"sim_time") + field(3, field(1, 0) + field(2, 1_500_000_000)))
    state = field(1, b"app") + field(3, field(1, b"Recording:ab_sim:run") + span)
    assert posted(page, "/seen", state, host="evil.example") == 421
    assert page.interval("run", []) == UNWATCHED
    assert posted(page, "/seen", state) == 204
    assert page.interval("run", [1.4, 1.5, 1.6, 1.7]) == BATCH, "the last but two has come"
    assert page.interval("run", [1.5, 1.6, 1.7, 1.8]) == LAGGING
    assert page.interval("another", [0.0, 0.1]) == BATCH, "so few may be on their way"
    assert page.interval("another", [0.0, 0.1, 0.2]) == LAGGING
    assert posted(page, "/seen", b"no state") == 204, "what another Rerun may say"
    assert page.interval("run", [1.5, 1.6, 1.7]) == BATCH
    assert posted(page, "/elsewhere") == 404


SLOW_TO_DRAW = b"""<html><body><canvas width="400" height="400"></canvas></body><script>
  const gl = document.querySelector("canvas").getContext("webgl2");
  const program = gl.createProgram();
  for (const [kind, source] of [
    [gl.VERTEX_SHADER, `void main() {
       gl_Position = vec4(gl_VertexID % 2 * 4 - 1, gl_VertexID / 2 * 4 - 1, 0, 1); }`],
    [gl.FRAGMENT_SHADER, `precision highp float; out vec4 color; void main() {
       float x = gl_FragCoord.x; for (int i = 0; i < 300; i++) x = sin(x); color = vec4(x); }`],
  ]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, "#version 300 es\\n" + source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  gl.useProgram(program);
  let fences = [];
  window.waiting = [];  // at the beginning of each frame, the frames that are not drawn yet
  requestAnimationFrame(function draw() {
    fences = fences.filter((f) => gl.getSyncParameter(f, gl.SYNC_STATUS) !== gl.SIGNALED);
    waiting.push(fences.length);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    fences.push(gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0));
    requestAnimationFrame(draw);
  });
</script></html>"""


@pytest.mark.long
def test_no_frame_begins_before_the_last_one_is_drawn() -> None:
    with page_before(SLOW_TO_DRAW) as page, browser() as screen:
        screen.open(f"http://127.0.0.1:{page.port}/")
        until(lambda: len(screen.evaluate("waiting")) > 12, "frames are drawn")
        assert set(screen.evaluate("waiting")) == {0}
