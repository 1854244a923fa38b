"""Address at which a viewer receives data: its proxy, in Rerun's notation."""

import socket
from enum import Enum
from typing import NamedTuple
from urllib.parse import quote, urlsplit

from ab_sim.base.errors import InputError

LOOPBACK = "127.0.0.1"
PATIENCE = 1.0
"""Time for a viewer to answer [s]."""
# HTTP/2, as gRPC uses it: preface of a client and empty settings; a server answers with settings.
_HELLO = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + bytes((0, 0, 0, 4, 0, 0, 0, 0, 0))
_SETTINGS = 4


class Answer(Enum):
    """Result of `Proxy.check`; the values are used in messages."""

    HERE = "answers"
    SILENT = "does not answer"
    NOBODY = "there is no viewer"


class Proxy(NamedTuple):
    """Address of a viewer's proxy."""

    host: str  # IP address
    port: int

    @classmethod
    def of(cls, url: str) -> "Proxy":
        """Return the proxy in ``rerun+http://HOST:PORT/proxy``.

        Raises
        ------
        InputError
            The text has another form, or the host is unknown.
        """
        try:
            parts = urlsplit(url)
            host, port = parts.hostname, parts.port
        except ValueError:  # the port is not a number
            host = port = None
        if host is None or port is None or url != f"rerun+http://{parts.netloc}/proxy":
            raise InputError(
                f"{url!r} is not the address of a viewer, rerun+http://HOST:PORT/proxy; Rerun "
                "prints it when it starts, e.g. rerun+http://127.0.0.1:9876/proxy"
            )
        try:
            addresses = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
        except OSError as error:
            raise InputError(f"{url}: the host {host} is not known: {error}") from error
        return cls(str(addresses[0][4][0]), port)

    @property
    def url(self) -> str:
        """Address in Rerun's notation."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"rerun+http://{host}:{self.port}/proxy"

    def page(self, port: int) -> str:
        """Return the address, on a port of this machine, of a web viewer for this proxy's data."""
        return f"http://{LOOPBACK}:{port}/?url={quote(self.url, safe='')}"

    def check(self) -> Answer:
        """Check whether a viewer is there and responds, in up to twice `PATIENCE`.

        A successful connection is not enough: the kernel accepts it for a stopped process, too.
        """
        try:
            with socket.create_connection(self, PATIENCE) as connection:
                connection.sendall(_HELLO)
                answer = connection.recv(9)
        except TimeoutError:
            return Answer.SILENT
        except OSError:
            return Answer.NOBODY
        return Answer.HERE if len(answer) == 9 and answer[3] == _SETTINGS else Answer.NOBODY


def free_port(wanted: int = 0) -> int:
    """Return a free port of this machine: ``wanted``, or any if ``wanted`` is 0.

    Raises
    ------
    InputError
        The port is taken.
    """
    with socket.socket() as taken:
        taken.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as servers do
        try:
            taken.bind((LOOPBACK, wanted))
        except OSError as error:
            raise InputError(
                f"port {wanted}: {error.strerror}; choose another one, or 0 for any that is free"
            ) from error
        return int(taken.getsockname()[1])
