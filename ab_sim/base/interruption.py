"""Handling of Ctrl-C, SIGTERM and a closing terminal: exit immediately, or in order if required.

Python runs signal handlers in the main thread, between two bytecode instructions. While LLVM
compiles, this is seconds too late. An exception of a handler also occurs at an arbitrary place,
such as an import, or a callback that prints it and continues. So the handlers here do nothing.
Python's C code writes the signal's number to a socket, and a thread reads it and acts.
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

_SHOW_CURSOR = b"\x1b[?25h"
"""Terminal code that shows the cursor, which a progress bar may have hidden."""
ONE_WISH = 1.0
"""Time after a signal in which further signals belong to the same request [s]: a program that ros2
launch has started gets Ctrl-C twice, from its terminal and from ros2 launch."""
_CLOSED = getattr(signal, "SIGHUP", None)
"""Signal of a closing terminal; Windows has none."""
KEPT = [number for number in (signal.SIGINT, _CLOSED) if number is not None]
"""Signals that ``kept_from_children`` blocks."""
_stopping: threading.Event | None = None
_watching = _leaving = False


def watch() -> None:
    """Make signals end the process immediately, with one line and exit code 128 + signal number.

    This function should be called before slow imports. A second call does nothing.
    """
    global _watching
    if _watching:
        return
    _watching = True
    outlet, inlet = socket.socketpair()  # Windows writes signals to sockets only
    inlet.setblocking(False)
    signal.set_wakeup_fd(inlet.detach(), warn_on_full_buffer=False)
    # SIGINT is also handled in background jobs, whose shell makes them ignore it: it was sent on
    # purpose. SIGHUP remains ignored if it was (nohup).
    numbers = [signal.SIGINT, signal.SIGTERM]
    if _CLOSED is not None and signal.getsignal(_CLOSED) is not signal.SIG_IGN:
        numbers.append(_CLOSED)
    for number in numbers:
        signal.signal(number, _leave_to_the_thread)
    thread = threading.Thread(target=_obey, args=(outlet,), name="signals", daemon=True)
    thread.start()


@contextlib.contextmanager
def in_order() -> Iterator[threading.Event]:
    """Yield an event that the first signal sets, instead of ending the process.

    A later signal ends the process immediately. Signals within ``ONE_WISH`` after the first one are
    ignored, even after this context.
    """
    global _stopping
    stopping = _stopping = threading.Event()
    try:
        yield stopping
    finally:
        _stopping = None


@contextlib.contextmanager
def kept_from_children() -> Iterator[None]:
    """Block Ctrl-C and the signal of a closing terminal in processes started in the context.

    Child processes inherit the signals that this thread blocks, from their first instruction on. In
    this process, another thread receives the signals, so that none is lost. In a child, signals are
    pending until it calls ``accept_signals``.
    """
    if sys.platform == "win32":  # cannot block signals
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, KEPT)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def accept_signals() -> None:
    """Unblock the signals that ``kept_from_children`` of the parent has blocked in this process."""
    if sys.platform != "win32":
        signal.pthread_sigmask(signal.SIG_UNBLOCK, KEPT)


def exit_process(code: int) -> NoReturn:
    """End the process with an exit code, after everything has been cleaned up.

    Python's own exit would first free compiled kernels and modules, which takes half a second, or
    two on a busy machine.
    """
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError):  # the reader may have gone
            stream.flush()
    if sys.platform != "win32":
        ctypes.CDLL(None).fflush(None)  # ROS logs through C
    os._exit(code)


def leave_at_exit() -> None:
    """Make ``left_at_exit`` end the process, because a library would block Python's own exit."""
    global _leaving
    _leaving = True


@contextlib.contextmanager
def left_at_exit() -> Iterator[None]:
    """End the process after the context if ``leave_at_exit`` was called during the context."""
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
    """Return the exit code with which Python would end for an error, and print Python's text."""
    if isinstance(error, SystemExit) and isinstance(error.code, int | None):
        return error.code or 0
    if isinstance(error, SystemExit):
        print(error.code, file=sys.stderr)
    else:
        traceback.print_exception(error)
    return 1


def _leave_to_the_thread(*_: object) -> None:
    """Do nothing; without a handler, Python would not write the signal to the socket."""


def _obey(outlet: socket.socket) -> None:
    """Read signals from the socket and act on them, in a thread, until the process ends."""
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
            bar = _SHOW_CURSOR + b"\n" if os.isatty(2) else b""
            os.write(2, bar + b"interrupted\n")
        os._exit(128 + number)
