"""The web viewer's page, kept from talking to anybody but the viewer.

Rerun's page, as Rerun serves it, tells Rerun about its use, asks GitHub for new versions and Google
for fonts. A page's server can forbid all that to the browser; so this one stands before Rerun's.

It answers only who asks for this machine by name. A stranger's web site may have its own name lead
to 127.0.0.1 (DNS rebinding); the browser then takes what is served here for a part of that site,
and lets its scripts read it. The name that was asked for is in the request's Host header.
(Rerun's two servers behind it do not look at that; their ports are drawn anew for each viewer.)
"""

import contextlib
import http.client
import ipaddress
import re
import shutil
import threading
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

LOOPBACK = "127.0.0.1"
PATIENCE = 30.0
"""s for Rerun to answer."""
_PASSED_ON = ("Content-Type", "Content-Encoding", "Content-Length")
_REFUSED = "This page is for this machine only: ask for it as 127.0.0.1 or localhost"

_HOST = re.compile(r"(\[[0-9a-fA-F:.]+\]|[\w.-]+)(?::\d{1,5})?", re.ASCII)


def is_loopback(host: str) -> bool:
    """Whether a Host header, ``NAME`` or ``NAME:PORT``, names this machine.

    Any port does: a tunnel may begin at another one.
    """
    if (found := _HOST.fullmatch(host)) is None:
        return False
    try:
        return ipaddress.ip_address(found[1].strip("[]")).is_loopback
    except ValueError:
        return found[1].lower() == "localhost"


class Page:
    """Serves the page of a web viewer on loopback, in threads of its own.

    Args:
        port: where.
        behind: port of this machine where Rerun serves it.
        proxy: ``http://HOST:PORT`` of the viewer's proxy, all that the page may talk to.
    """

    def __init__(self, port: int, behind: int, proxy: str) -> None:
        here = "'self' 'unsafe-inline' 'unsafe-eval' data: blob:"
        policy = f"default-src {here}; connect-src 'self' data: blob: {proxy}"

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                named = self.headers.get_all("Host", [])
                with contextlib.suppress(OSError, http.client.HTTPException):
                    if len(named) == 1 and is_loopback(named[0]):
                        self._relay()
                    else:
                        self.send_error(HTTPStatus.MISDIRECTED_REQUEST, explain=_REFUSED)

            def _relay(self) -> None:
                connection = http.client.HTTPConnection(LOOPBACK, behind, timeout=PATIENCE)
                with contextlib.closing(connection):
                    connection.request("GET", self.path)
                    answer = connection.getresponse()
                    self.send_response(answer.status)
                    for name in _PASSED_ON:
                        if value := answer.getheader(name):
                            self.send_header(name, value)
                    self.send_header("Content-Security-Policy", policy)
                    self.end_headers()
                    shutil.copyfileobj(answer, self.wfile)

            def log_message(self, *_: object) -> None:
                pass

        self._server = ThreadingHTTPServer((LOOPBACK, port), Handler)
        self._server.daemon_threads = True
        self.port: int = self._server.server_address[1]
        self._thread = threading.Thread(target=self._server.serve_forever, name="page", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Serve it no longer."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()
