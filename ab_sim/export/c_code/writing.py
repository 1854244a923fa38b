"""Writing of a drive's files: all of them or none, without replacing files of other origin."""

from contextlib import ExitStack
from pathlib import Path

from ab_sim.base.errors import InputError
from ab_sim.base.files import check_can_be_made, replacing, write_whole
from ab_sim.export.c_code.fmu import Fmu, fmu_of, identifier_of
from ab_sim.export.c_code.sources import MARK, DriveSources


def check_output(folder: Path, names: list[str], option: str) -> None:
    """Refuse a folder that is not writable, or that has files of other origin with these names.

    Args:
        folder: folder to write to.
        names: names of the files to write.
        option: name of the folder in messages, e.g. ``--out``.

    Raises:
        InputError: the folder cannot be used; the message states the reason.
    """
    check_can_be_made(folder, option)
    for name in names:
        file = folder / name
        if file.is_dir() or (file.exists() and MARK not in _first_line(file)):
            raise InputError(
                f"{option} {folder}: has a {name} that ab-sim did not write; name another folder, "
                "e.g. a new one"
            )


def write_sources(sources: DriveSources, folder: Path, option: str) -> list[Path]:
    """Write a drive's files to a folder, which is created if missing; return their paths.

    Args:
        sources: files to write.
        folder: folder to write to.
        option: name of the folder in messages.

    Raises:
        InputError: the folder cannot be used or a file cannot be written; nothing has changed.
    """
    check_output(folder, list(sources.files), option)
    try:
        with ExitStack() as unfinished:
            for name, text in sources.files.items():
                file = unfinished.enter_context(replacing(folder / name))
                file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"{option} {folder}: cannot be written: {error.strerror}") from error
    return [folder / name for name in sources.files]


def write_fmu(sources: DriveSources, file: Path, option: str) -> Fmu:
    """Write a drive's FMU and return it.

    Args:
        sources: sources of the drive.
        file: file to write.
        option: name of the file in messages.

    Raises:
        InputError: the C compiler fails, or the file cannot be written; nothing has changed.
    """
    content = fmu_of(sources, identifier_of(file.stem))
    try:
        write_whole(file, content.content)
    except OSError as error:
        raise InputError(f"{option} {file}: cannot be written: {error.strerror}") from error
    return content


def _first_line(file: Path) -> str:
    with file.open(encoding="utf-8", errors="replace") as opened:
        return opened.readline(1000)
