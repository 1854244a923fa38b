"""Ctrl-C, SIGTERM and a terminal that closes: the end at any instant, or in order where it matters.

Python runs signal handlers in the main thread, between two of its own instructions. While LLVM
compiles that is seconds too late, and an exception raised there surfaces wherever the program is
just then: in an import, in a callback that prints it and goes on. So no handler does anything here.
Python's C part writes the signal's number to a pipe, and a thread that reads the pipe acts on it.
"""

import contextlib
import ctypes
import math
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from typing import NoReturn

SHOW_CURSOR = b"\x1b[?25h"
"""To a terminal: a progress bar may have hidden it."""
ONE_WISH = 1.0
"""s after the signal that began an end in order, in which further ones mean the same: Ctrl-C
reaches a program from its terminal, and once more from the launch that started it."""
KEPT = [signal.SIGINT, signal.SIGHUP]
"""From children, if they are."""
_stopping: threading.Event | None = None
_watching = _leaving = False


def watch() -> None:
    """From now on, a signal ends the process at once: one line, exit code 128 + its number.

    To be called before anything slow is imported. A second call does nothing.
    """
    global _watching
    if _watching:
        return
    _watching = True
    outlet, inlet = os.pipe()
    os.set_blocking(inlet, False)
    signal.set_wakeup_fd(inlet, warn_on_full_buffer=False)
    # A shell's background jobs ignore SIGINT, and yet whoever sends it means it; whoever ignores
    # SIGHUP (nohup) means that.
    numbers = [signal.SIGINT, signal.SIGTERM]
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        numbers.append(signal.SIGHUP)
    for number in numbers:
        signal.signal(number, _leave_to_the_thread)
    thread = threading.Thread(target=_obey, args=(outlet,), name="signals", daemon=True)
    thread.start()


@contextlib.contextmanager
def in_order() -> Iterator[threading.Event]:
    """Within it the first signal sets the event that is given.

    A later one ends the process at once, but those within ``ONE_WISH`` count as the same one,
    behind this context too.
    """
    global _stopping
    stopping = _stopping = threading.Event()
    try:
        yield stopping
    finally:
        _stopping = None


@contextlib.contextmanager
def kept_from_children() -> Iterator[None]:
    """Processes that this thread starts within it leave Ctrl-C and a closed terminal to this one.

    They inherit what the thread blocks, from their first instruction on; in this process another
    thread takes the signals, so that none is lost. What is sent to such a process waits until it
    calls ``heed``.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, KEPT)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def heed() -> None:
    """From now on take what ``kept_from_children`` has kept from this process."""
    signal.pthread_sigmask(signal.SIG_UNBLOCK, KEPT)


def leave(code: int) -> NoReturn:
    """End the process, now that everything is in order, with an exit code.

    Python itself would first take compiled kernels and modules apart, piece by piece: half a
    second, on a busy machine two.
    """
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError):  # whoever listened may be gone
            stream.flush()
    ctypes.CDLL(None).fflush(None)  # ROS logs through C
    os._exit(code)


def leave_at_exit() -> None:
    """Have ``left_at_exit`` end the process: a library would keep Python from its own end."""
    global _leaving
    _leaving = True


@contextlib.contextmanager
def left_at_exit() -> Iterator[None]:
    """Where ``leave_at_exit`` was called, ``SystemExit`` within it ends the process at once."""
    try:
        yield
    except SystemExit as done:
        if _leaving:
            leave(done.code if isinstance(done.code, int) else 0)
        raise


def _leave_to_the_thread(*_: object) -> None:
    pass


def _obey(outlet: int) -> None:
    first = -math.inf
    while True:
        number = os.read(outlet, 1)[0]
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
