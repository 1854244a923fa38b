"""File that Rerun writes through a pipe, so that write errors can be handled."""

from __future__ import annotations

import contextlib
import os
import select
import stat
import threading
from pathlib import Path

import rerun as rr

from ab_sim.base.errors import RecordingError

FLUSH_SECONDS = 10.0  # A disk that takes longer counts as failed.


class PipedFile:
    """Copies the output of Rerun from a pipe to a file.

    Rerun 0.41 cannot handle an error of a file: its writer thread ends, the reason is only printed,
    and often flush(), disconnect() and the exit of the process then block forever. A pipe does not
    fail, and this class raises the errors of the file.

    Parameters
    ----------
    path
        File; an existing one is replaced.
    stream
        Stream of Rerun.
    index
        Whether Rerun writes its index at the end.

    Raises
    ------
    RecordingError
        The file cannot be created.
    """

    def __init__(self, path: Path, stream: rr.RecordingStream, index: bool) -> None:
        if not path.parent.is_dir():
            raise RecordingError(f"cannot record to {path}: there is no folder {path.parent}")
        try:
            self._file = path.open("wb", buffering=0)
        except OSError as error:
            raise RecordingError(f"cannot record to {path}: {error.strerror}") from error
        self._path = path
        self._error: OSError | None = None
        self._whole = 0  # size when the file last ended with a complete message [bytes]
        self._lock = threading.Lock()  # held while data are copied from pipe to file
        self._buffer = bytearray(1 << 20)  # allocated once: repeated allocation fragments memory
        outlet, inlet = os.pipe()
        os.set_blocking(outlet, False)
        self._pipe = os.fdopen(outlet, "rb", buffering=0)
        stream.set_sinks(rr.FileSink(f"/dev/fd/{inlet}", write_footer=index))
        os.close(inlet)  # Rerun has opened the pipe again: when it closes it, the pipe ends
        self._thread = threading.Thread(target=self._pump, name="recording", daemon=True)
        self._thread.start()

    def sync(self) -> None:
        """Wait until all data that Rerun has flushed are in the file.

        Raises
        ------
        OSError
            The file cannot be written; FileNotFoundError: it was deleted or replaced.
        """
        self._drain()
        self._error = self._error or self._loss()
        if self._error:
            raise self._error
        self._whole = self._file.tell()

    def close(self) -> None:
        """Copy the remaining data until Rerun disconnects, and close the file.

        Raises
        ------
        OSError
            The file cannot be written, or the disk does not answer.
        """
        self._thread.join(FLUSH_SECONDS)
        if self._thread.is_alive():
            raise TimeoutError(f"the disk did not answer for {FLUSH_SECONDS:g} s")
        self.sync()
        self._file.close()

    def _loss(self) -> OSError | None:
        """Return an error if the file was deleted, replaced or changed by others; else None."""
        file = os.fstat(self._file.fileno())
        try:
            if not os.path.samestat(self._path.stat(), file):
                return FileNotFoundError("the file has been replaced")
        except FileNotFoundError:
            return FileNotFoundError("the file has been deleted or renamed")
        except OSError as error:
            return error
        if stat.S_ISREG(file.st_mode) and file.st_size != self._file.tell():
            return FileNotFoundError("another program has written to the file, or emptied it")
        return None

    def cut(self) -> None:
        """Remove an incomplete message at the end, which would make the file unreadable."""
        with contextlib.suppress(OSError):  # a device, for example, cannot be truncated
            self._file.truncate(self._whole)

    def remove(self) -> None:
        """Delete the file, unless it was replaced or is not a regular file."""
        with contextlib.suppress(OSError):
            file = os.fstat(self._file.fileno())
            if stat.S_ISREG(file.st_mode) and os.path.samestat(self._path.stat(), file):
                self._path.unlink()

    def _pump(self) -> None:
        """Copy data as they arrive, until Rerun closes the pipe; runs in its own thread."""
        poll = select.poll()
        poll.register(self._pipe)
        while self._drain():
            poll.poll()

    def _drain(self) -> bool:
        """Copy the pipe's data to the file; return False when the pipe is closed."""
        # Both the thread and `sync` copy: the thread keeps the pipe from filling up, which would
        # block Rerun, and `sync` must not return before the data it waits for are copied.
        with self._lock:
            while size := self._pipe.readinto(self._buffer):
                rest = memoryview(self._buffer)[:size]
                self._error = self._error or self._loss()
                try:
                    while rest and not self._error:  # after an error, only keep the pipe empty
                        rest = rest[self._file.write(rest) :]
                except OSError as error:
                    self._error = error
            return size is None  # None: no data at present; 0: closed
