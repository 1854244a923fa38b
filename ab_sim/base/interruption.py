"""Ctrl-C, SIGTERM and a closing terminal: exit at once, or in order if required.

Python runs signal handlers in the main thread, between two bytecode instructions. While LLVM
compiles, that is seconds too late, and an exception raised there surfaces at an arbitrary place: in
an import, or in a callback that prints it and continues. So the handlers here do nothing. Python's
C code writes the signal's number to a socket, and a thread that reads it acts on it.
"""

import contextlib
import ctypes
import math
import os
import signal
import socket
import sys
import threading
import time
import traceback
from collections.abc import Iterator
from typing import NoReturn

SHOW_CURSOR = b"\x1b[?25h"
"""Terminal code that shows the cursor, which a progress bar may have hidden."""
ONE_WISH = 1.0
"""Time after the first signal in which further ones count as the same request [s]: Ctrl-C reaches a
program from its terminal, and again from the launch that started it."""
_CLOSED = getattr(signal, "SIGHUP", None)
"""Signal of a closing terminal; Windows has none."""
KEPT = [number for number in (signal.SIGINT, _CLOSED) if number is not None]
"""Signals that ``kept_from_children`` blocks."""
_stopping: threading.Event | None = None
_watching = _leaving = False


def watch() -> None:
    """Let signals end the process at once, with one line and exit code 128 + their number.

    Call it before slow imports. A second call does nothing.
    """
    global _watching
    if _watching:
        return
    _watching = True
    outlet, inlet = socket.socketpair()  # Windows writes signals to sockets only
    inlet.setblocking(False)
    signal.set_wakeup_fd(inlet.detach(), warn_on_full_buffer=False)
    # Background jobs of a shell ignore SIGINT, but a sender of SIGINT means it. A process that
    # ignores SIGHUP (nohup) is respected.
    numbers = [signal.SIGINT, signal.SIGTERM]
    if _CLOSED is not None and signal.getsignal(_CLOSED) is not signal.SIG_IGN:
        numbers.append(_CLOSED)
    for number in numbers:
        signal.signal(number, _leave_to_the_thread)
    thread = threading.Thread(target=_obey, args=(outlet,), name="signals", daemon=True)
    thread.start()


@contextlib.contextmanager
def in_order() -> Iterator[threading.Event]:
    """Set the yielded event on the first signal, instead of ending the process.

    A later signal ends the process at once. Signals within ``ONE_WISH`` of the first count as the
    same one, even after this context.
    """
    global _stopping
    stopping = _stopping = threading.Event()
    try:
        yield stopping
    finally:
        _stopping = None


@contextlib.contextmanager
def kept_from_children() -> Iterator[None]:
    """Keep Ctrl-C and a closing terminal from processes that this thread starts in the context.

    They inherit the signals that the thread blocks, from their first instruction on. In this
    process another thread takes the signals, so that none is lost. A signal to such a process waits
    until it calls ``accept_signals``.
    """
    if not hasattr(signal, "pthread_sigmask"):  # Windows, which has other means
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, KEPT)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def accept_signals() -> None:
    """Accept the signals that ``kept_from_children`` has blocked for this process."""
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, KEPT)


def exit_process(code: int) -> NoReturn:
    """End the process with an exit code, after everything has been cleaned up.

    Python itself would first free compiled kernels and modules, which takes half a second, or two
    on a busy machine.
    """
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError):  # the reader may have gone
            stream.flush()
    if os.name == "posix":
        ctypes.CDLL(None).fflush(None)  # ROS logs through C
    os._exit(code)


def leave_at_exit() -> None:
    """Have ``left_at_exit`` end the process: a library would keep Python from its own end."""
    global _leaving
    _leaving = True


@contextlib.contextmanager
def left_at_exit() -> Iterator[None]:
    """End the process right after the ``with`` block if that has called ``leave_at_exit``."""
    code = 0
    try:
        yield
    except BaseException as error:
        if not _leaving:
            raise
        code = _exit_code_of(error)
    if _leaving:
        exit_process(code)


def _exit_code_of(error: BaseException) -> int:
    """Return the exit code of an error as Python would, and print the same text."""
    if isinstance(error, SystemExit) and isinstance(error.code, int | None):
        return error.code or 0
    if isinstance(error, SystemExit):
        print(error.code, file=sys.stderr)
    else:
        traceback.print_exception(error)
    return 1


def _leave_to_the_thread(*_: object) -> None:
    pass


def _obey(outlet: socket.socket) -> None:
    first = -math.inf
    while True:
        number = outlet.recv(1)[0]
        if time.monotonic() - first < ONE_WISH:
            continue
        stopping = _stopping
        if stopping is not None and not stopping.is_set():
            first = time.monotonic()
            stopping.set()
            continue
        with contextlib.suppress(OSError):  # the terminal may be gone
            bar = SHOW_CURSOR + b"\n" if os.isatty(2) else b""
            os.write(2, bar + b"interrupted\n")
        os._exit(128 + number)
