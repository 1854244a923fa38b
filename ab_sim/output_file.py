"""Files that results go to are refused before any work is done, by whoever will write them."""

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from ab_sim.errors import InputError

PICTURE = (".png", ".svg", ".pdf")
RECORDING = (".rrd",)
REPORT = (".json",)
PARQUET = (".parquet",)
CSV = (".csv",)
PNG = (".png",)
PAGE = (".html",)
SCENE = (".yaml", ".yml")
FMU = (".fmu",)
BAG_FILE = (".mcap", ".db3", ".bag")


LONGEST_NAME = 255
"""Bytes of a file's name, on the usual file systems."""


def check_name(path: Path, said: str) -> None:
    """Refuse a name that file systems, or the libraries that write files, do not take.

    Raises:
        InputError: names the path and what is allowed.
    """
    try:
        lengths = [len(part.encode()) for part in path.parts]
    except UnicodeEncodeError:
        raise InputError(f"{said} {path}: is not UTF-8; choose another name") from None
    if max(lengths, default=0) > LONGEST_NAME:
        raise InputError(
            f"{said} {path}: has a name of {max(lengths)} bytes; must be at most {LONGEST_NAME}"
        )


def check_ending(path: Path, endings: Sequence[str], said: str) -> None:
    """Refuse a name that is for something else: a slip of the pen would replace, say, a picture.

    Args:
        path: a file that is to be written.
        endings: what its name may end in.
        said: what to call it in messages, e.g. ``--plot``.

    Raises:
        InputError: names the path and what is allowed.
    """
    check_name(path, said)
    if path.is_dir():
        raise InputError(f"{said} {path}: is a folder; name a file in it")
    if path.suffix.lower() not in endings:
        one_of = "one of " if len(endings) > 1 else ""
        raise InputError(f"{said} {path}: must end in {one_of}{', '.join(endings)}")


def check_folder(path: Path, said: str) -> None:
    """Refuse a bag's folder that is called like one of the files that will be in it.

    Args:
        path: of the folder.
        said: what to call it in messages, e.g. ``--mcap``.

    Raises:
        InputError: names the path and one that would do.
    """
    check_name(path, said)
    if path.suffix.lower() in BAG_FILE:
        raise InputError(
            f"{said} {path}: a bag is a folder, with a file {path.stem}{path.suffix} in it; "
            f"name the folder, e.g. {path.with_suffix('')}"
        )


def check_writable(path: Path, said: str, replaced: bool = True) -> None:
    """Refuse a file that cannot be written.

    Args:
        path: where.
        said: what to call it in messages, e.g. ``--plot``.
        replaced: whether a file that is there will be; else another one is made beside it.

    Raises:
        InputError: names the path and what is wrong with it.
    """
    check_name(path, said)
    try:
        if path.exists() and not path.is_file():
            what = "a folder" if path.is_dir() else "a device or a pipe"
            raise InputError(f"{said} {path}: is {what}; name a file")
        file = path.resolve()
        if not file.parent.is_dir():
            raise InputError(f"{said} {path}: there is no folder {path.parent}; make it first")
        if replaced and file.exists():
            file.open("r+b").close()
        _try_folder(file.parent)
    except (OSError, RuntimeError) as error:  # RuntimeError: links in a circle
        raise InputError(
            f"{said} {path}: cannot be written: {_reason(error)}; choose another place or change "
            "its rights"
        ) from error


def check_can_be_made(folder: Path, said: str) -> None:
    """Refuse a folder for results that is not there and cannot be made; it is made with the first.

    Args:
        folder: where.
        said: what to call it in messages, e.g. ``--out``.

    Raises:
        InputError: names the folder and what is wrong with it.
    """
    check_name(folder, said)
    try:
        above = next(each for each in (folder, *folder.absolute().parents) if each.exists())
        if not above.is_dir():
            raise InputError(f"{said} {folder}: cannot be made: {above} is no folder")
        _try_folder(above)
    except OSError as error:
        raise InputError(f"{said} {folder}: cannot be made: {_reason(error)}") from error


def _try_folder(folder: Path) -> None:
    """Write a file there, of which nothing stays; rights alone do not say whether one can.

    Raises:
        OSError: one cannot: for want of rights or room, or the file system takes none.
    """
    with tempfile.TemporaryFile(dir=folder) as trial:
        trial.write(b"\n")


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)


def write_whole(file: Path, content: bytes) -> None:
    """Write a file such that whoever reads it finds all of the new content, or the old one.

    Raises:
        OSError: it cannot be written; nothing has changed.
    """
    with replacing(file) as unfinished:
        unfinished.write_bytes(content)


@contextlib.contextmanager
def replacing(file: Path) -> Iterator[Path]:
    """Gives another file in the same folder to write to, which becomes ``file`` at the end.

    After an exception it is gone, and nothing has changed. The folder is made if need be; of a
    link, the file that it leads to is replaced.

    Raises:
        OSError: it cannot be written.
    """
    file = file.resolve()
    file.parent.mkdir(parents=True, exist_ok=True)
    descriptor, name = tempfile.mkstemp(dir=file.parent, prefix=".unfinished-")
    os.close(descriptor)
    unfinished = Path(name)
    try:
        yield unfinished
        if file.exists():
            shutil.copymode(file, unfinished)
        else:
            mask = os.umask(0)
            os.umask(mask)
            unfinished.chmod(0o666 & ~mask)
        unfinished.replace(file)
    except BaseException:
        unfinished.unlink(missing_ok=True)
        raise
