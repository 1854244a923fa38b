"""Writing of a drive's files: all of them or none, and never over files of others."""

from contextlib import ExitStack
from pathlib import Path

from ab_sim.base.errors import InputError
from ab_sim.base.output_file import check_can_be_made, replacing, write_whole
from ab_sim.export.c_code.fmu import Fmu, fmu_of, identifier_of
from ab_sim.export.c_code.sources import MARK, DriveSources


def check_output(folder: Path, names: list[str], option: str) -> None:
    """Refuse a folder that is not writable, or that has other files with these names.

    Args:
        folder: the folder.
        names: names of the files.
        option: name of the folder in messages, e.g. ``--out``.

    Raises:
        InputError: the folder cannot be used; the message states the reason.
    """
    check_can_be_made(folder, option)
    for name in names:
        file = folder / name
        if file.is_dir() or (file.exists() and MARK not in _first_line(file)):
            raise InputError(
                f"{option} {folder}: has a {name} that is not of ab-sim's making; name another "
                "folder, one of its own"
            )


def write_sources(sources: DriveSources, folder: Path, option: str) -> list[Path]:
    """Write a drive's files to a folder, which is created if missing.

    Raises:
        InputError: see ``check_output``; or a file cannot be written. Nothing has changed then.
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
    """Write a drive's FMU.

    Raises:
        InputError: the C compiler fails, or the file cannot be written. Nothing has changed then.
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
