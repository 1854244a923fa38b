"""The web viewer's page, kept from talking to anybody but the viewer.

Rerun's page, as Rerun serves it, tells Rerun about its use, asks GitHub for new versions and Google
for fonts. A page's server can forbid all that to the browser; so this one stands before Rerun's.
"""

import contextlib
import http.client
import shutil
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

LOOPBACK = "127.0.0.1"
PATIENCE = 30.0
"""s for Rerun to answer."""
_PASSED_ON = ("Content-Type", "Content-Encoding", "Content-Length")


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
                with contextlib.suppress(OSError, http.client.HTTPException):
                    self._relay()

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
