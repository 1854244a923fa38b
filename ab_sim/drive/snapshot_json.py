"""Common code of snapshot files: JSON, written atomically, valid only for the same sources."""

import functools
import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import ab_sim
from ab_sim.base.errors import InputError, shortened
from ab_sim.base.files import REPORT, check_ending, check_regular, check_writable, write_whole
from ab_sim.base.sources import NotOfSources, sources

MOST_BYTES = 1 << 24
"""Largest size of a file; hours of commands take some MB."""


def write_content(path: Path, content: Mapping[str, Any]) -> None:
    """Write a snapshot file; an existing file is replaced atomically.

    Only a snapshot of the same format is replaced, because any ROS peer can set the parameter that
    the path may come from.

    Args:
        path: file that ends in .json.
        content: JSON-able values, including the name of their ``format``.

    Raises:
        InputError: the file cannot be written, or the existing file is no such snapshot.
    """
    check_ending(path, REPORT, "snapshot")
    check_writable(path, "snapshot")
    if path.is_symlink():
        raise InputError(f"snapshot {path}: is a symbolic link; name the file itself")
    if path.exists() and path.stat().st_size:
        try:
            read_content(path, content["format"], "another one")
        except InputError as error:
            raise InputError(
                f"snapshot {path}: the existing file is not an {content['format']}; name "
                "another file, or remove it"
            ) from error
    try:
        write_whole(path, json.dumps(content, indent=1).encode())
    except OSError as error:
        raise InputError(f"snapshot {path}: cannot be written: {error.strerror}") from error


def read_content(path: Path, named: str, otherwise: str) -> dict[str, Any]:
    """Read a snapshot file.

    Args:
        path: file to read.
        named: expected value of ``format``.
        otherwise: end of the message for a JSON file with another format.

    Raises:
        InputError: the file is missing, damaged, or of another format.
    """
    try:
        check_regular(path)
        with path.open("rb") as file:
            text = file.read(MOST_BYTES + 1)
        if len(text) > MOST_BYTES:
            raise InputError(
                f"snapshot {path}: is not a snapshot: it has more than {MOST_BYTES} bytes"
            )
        content = json.loads(text)
    except OSError as error:
        raise InputError(f"snapshot {path}: cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"snapshot {path}: is damaged, or not a snapshot: {error}") from error
    if not isinstance(content, dict) or content.get("format") != named:
        raise InputError(f"snapshot {path}: is a JSON file, but {otherwise}")
    return content


def origin(*modules: str) -> dict[str, str]:
    """Return version and sources that a file must have to be continued with the same bits.

    Args:
        modules: names of the modules that continue.

    Raises:
        InputError: the sources of a module have changed since it was imported.
    """
    return {"ab_sim": ab_sim.__version__, "kernel": _kernel(*modules)}


def check_origin(path: Path, content: Mapping[str, Any], *modules: str) -> None:
    """Refuse a file that these modules did not write.

    Raises:
        InputError: the file was written by another version or other sources.
    """
    ours = origin(*modules)
    if any(content.get(key) != value for key, value in ours.items()):
        program, kernel = (shortened(str(content.get(key))) for key in ours)
        raise InputError(
            f"snapshot {path}: is of ab_sim {program} with kernel {kernel}, and this is "
            f"{ours['ab_sim']} with {ours['kernel']}: it would not continue with the same bits; "
            "save it again"
        )


@functools.cache
def _kernel(*modules: str) -> str:
    """Return a short digest of the modules' sources."""
    try:
        made_of = sources(list(modules))
    except NotOfSources as error:
        raise InputError(f"snapshot: {error}; start this process again") from error
    digests = "".join(source.digest for source in made_of.values())
    return hashlib.sha256(digests.encode()).hexdigest()[:16]
