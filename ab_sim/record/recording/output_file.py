"""File with the messages that Rerun encodes in memory, so that write errors can be handled."""

from __future__ import annotations

import contextlib
import os
import stat
from pathlib import Path

import rerun as rr

from ab_sim.base.errors import RecordingError
from ab_sim.record.recording.rerun_file import header_and_messages


class OutputFile:
    """Writes the messages of Rerun to a file.

    Rerun 0.41 cannot handle an error of a file: its writer thread ends, the reason is only printed,
    and often flush(), disconnect() and the exit of the process then block forever. Here Rerun only
    encodes messages in memory, and this class writes them.

    Parameters
    ----------
    path
        File; an existing one is replaced.
    stream
        Stream of Rerun.

    Raises
    ------
    RecordingError
        The file cannot be created.
    """

    def __init__(self, path: Path, stream: rr.RecordingStream) -> None:
        if not path.parent.is_dir():
            raise RecordingError(f"cannot record to {path}: there is no folder {path.parent}")
        try:
            self._file = path.open("wb", buffering=0)
        except OSError as error:
            raise RecordingError(f"cannot record to {path}: {error.strerror}") from error
        self._path = path
        self._whole = 0  # size when the file last ended with a complete message [bytes]
        self._encoded = rr.binary_stream(stream)

    def sync(self) -> None:
        """Write all messages that Rerun has got.

        Raises
        ------
        OSError
            The file cannot be written; FileNotFoundError: it was deleted or replaced.
        """
        self._check_presence()
        if (encoded := self._encoded.read()) is not None:
            # Each call returns a complete recording, with a header, an end mark and an index of
            # its messages. The file gets the first header, and no end marks and indices.
            header, messages = header_and_messages(encoded)
            if not self._whole:
                self._write(header)
            self._write(messages)
            self._check_presence()
        self._whole = self._file.tell()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _write(self, data: memoryview) -> None:
        """Write data that the system may take in several parts."""
        while data:
            data = data[self._file.write(data) :]

    def _check_presence(self) -> None:
        """Raise an error if the file was deleted, replaced or changed by others."""
        file = os.fstat(self._file.fileno())
        try:
            is_same = os.path.samestat(self._path.stat(), file)
        except FileNotFoundError:
            raise FileNotFoundError("the file has been deleted or renamed") from None
        if not is_same:
            raise FileNotFoundError("the file has been replaced")
        if stat.S_ISREG(file.st_mode) and file.st_size != self._file.tell():
            raise FileNotFoundError("another program has written to the file, or emptied it")

    def cut(self) -> None:
        """Remove an incomplete message at the end, which would make the file unreadable."""
        with contextlib.suppress(OSError):  # a device, for example, cannot be truncated
            self._file.truncate(self._whole)

    def remove(self) -> None:
        """Delete the file, unless it was replaced or is not a regular file."""
        with contextlib.suppress(OSError):
            file = os.fstat(self._file.fileno())
            is_ours = stat.S_ISREG(file.st_mode) and os.path.samestat(self._path.stat(), file)
            self._file.close()  # Windows deletes only closed files
            if is_ours:
                self._path.unlink()
